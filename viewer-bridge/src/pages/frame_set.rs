//! The newest state, as pages receive it.

use bytes::Bytes;

use crate::limits::F32_PARTICLES_MAX;
use crate::message::Choice;
use crate::sink::State;
use crate::wire::{Format, frame_flag};

/// The newest state, in every format that a page waited for.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameSet {
    /// Number of the frame; ascending.
    pub(crate) number: u32,
    /// The properties that decide the format of each page.
    pub(crate) properties: FrameProperties,
    /// FRAME f32.
    pub(crate) f32: Option<Bytes>,
    /// FRAME u16.
    pub(crate) u16: Option<Bytes>,
    /// The colliders of the load, if it has any.
    pub(crate) colliders: Option<ColliderSet>,
    /// FORCES of the same step, if they were read.
    pub(crate) forces: Option<Bytes>,
    /// GHOST beside it, if a ghost is chosen and has a state there.
    pub(crate) ghost: Option<Bytes>,
    /// SPEEDS of the same step, if a page wants them.
    pub(crate) speeds: Option<Bytes>,
    /// INSPECTED of the same step, with the particles that any page wants.
    pub(crate) inspected: Option<Bytes>,
}

impl FrameSet {
    /// Size of all messages.
    pub(super) fn size_bytes(&self) -> usize {
        let colliders = self.colliders.as_ref().map(|colliders| &colliders.bytes);
        let Self { f32, u16, forces, ghost, speeds, inspected, .. } = self;
        let messages = [f32, u16, forces, ghost, speeds, inspected].map(Option::as_ref);
        messages.into_iter().chain([colliders]).flatten().map(Bytes::len).sum()
    }
}

/// The colliders of a state.
#[derive(Debug, Clone)]
pub(crate) struct ColliderSet {
    /// Changes with every change of the colliders.
    pub(crate) number: u64,
    /// COLLIDERS.
    pub(crate) bytes: Bytes,
}

/// The formats that pages wait for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Formats {
    /// FRAME f32.
    pub f32: bool,
    /// FRAME u16.
    pub u16: bool,
}

impl Formats {
    /// Returns whether a page waits for a frame.
    pub fn is_any(self) -> bool {
        self.f32 || self.u16
    }

    pub(super) fn add(&mut self, format: Format) {
        match format {
            Format::F32 => self.f32 = true,
            Format::U16 => self.u16 = true,
        }
    }
}

/// The properties of a state that decide the format in which a page receives it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FrameProperties {
    /// Number of particles.
    pub(crate) particle_count: usize,
    /// Nothing moves until the next command.
    pub(crate) is_paused: bool,
}

impl FrameProperties {
    pub(super) fn from_state(state: &State<'_>) -> Self {
        let is_paused = state.flags & frame_flag::PAUSED != 0;
        Self { particle_count: state.particles.len(), is_paused }
    }

    /// The format for a page. Exact positions are worth their size while they stay on show.
    pub(super) fn format_for(self, choice: Choice) -> Format {
        let is_exact = self.is_paused || self.particle_count <= F32_PARTICLES_MAX;
        match choice {
            Choice::F32 => Format::F32,
            Choice::Auto if is_exact => Format::F32,
            Choice::Auto | Choice::U16 => Format::U16,
        }
    }
}
