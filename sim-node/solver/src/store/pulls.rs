//! The pulls of constraints and bends on fixed particles.
//!
//! A projection does not move a fixed particle, so its pull is measured at a free one: no two constraints of a
//! group share a particle, so one that a group moves is moved by the constraint with the fixed particle
//! alone. The measured changes are those that the particle really makes, so impulses and momentum agree up to
//! the rounding of a sum.

use std::ops::Range;

use glam::DVec3;

/// A constraint or bend with a fixed particle, measured at a free one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pull {
    /// Number of the projection that moves the free particle: a group of the graph, or of a row.
    pub(crate) projection: usize,
    /// Where the x displacement of the free particle is among the numbers of all.
    pub(crate) at: usize,
    /// Index of the fixed particle among those that are fixed.
    pub(crate) receiver: usize,
    /// Impulse on the fixed particle over the change of the free one's velocity, in kg.
    pub(crate) factor: f32,
}

/// The pulls in the graph or in a sheet. Empty while nobody asks for forces.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pulls {
    /// By projection: its first run. One more at the end.
    starts: Vec<u32>,
    runs: Vec<Run>,
    /// In the order of the runs.
    all: Vec<Pull>,
    /// By run: the displacements before the projection, axis by axis, then the sums of their changes.
    memory: Vec<f32>,
}

/// Pulls of a projection whose free particles lie side by side.
#[derive(Debug, Clone)]
struct Run {
    pulls: Range<usize>,
    at: usize,
}

/// Numbers of a run in memory for each of its pulls.
const NUMBERS: usize = 6;

impl Pulls {
    /// Sorts pulls for projections with numbers below `projection_count`.
    pub(crate) fn new(mut pulls: Vec<Pull>, projection_count: usize) -> Self {
        pulls.sort_unstable_by_key(|pull| (pull.projection, pull.at, pull.receiver));
        let mut runs: Vec<Run> = Vec::new();
        for (index, pull) in pulls.iter().enumerate() {
            let is_next = |run: &&mut Run| {
                let length = run.pulls.len();
                pulls[run.pulls.start].projection == pull.projection && run.at + length == pull.at
            };
            match runs.last_mut().filter(is_next) {
                Some(run) => run.pulls.end += 1,
                None => runs.push(Run { pulls: index..index + 1, at: pull.at }),
            }
        }
        let first =
            |number: usize| runs.partition_point(|run| pulls[run.pulls.start].projection < number);
        #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^32 constraints and bends")]
        let starts = (0..=projection_count).map(|number| first(number) as u32).collect();
        let memory = vec![0.0; NUMBERS * pulls.len()];
        Self { starts, runs, all: pulls, memory }
    }

    /// Returns true if somebody asks for forces.
    pub(crate) fn is_measured(&self) -> bool {
        !self.starts.is_empty()
    }

    /// Forgets the changes of the last step.
    pub(crate) fn clear(&mut self) {
        self.memory.fill(0.0);
    }

    /// All projections.
    pub(crate) fn whole(&mut self) -> PullsPart<'_> {
        let Self { starts, runs, memory, .. } = self;
        PullsPart { starts, runs, memory, first: 0 }
    }

    /// Adds the impulses, times the length of a substep, to those of the fixed particles.
    pub(crate) fn add_to(&self, impulses: &mut [DVec3]) {
        for run in &self.runs {
            let length = run.pulls.len();
            let sums = &self.memory[NUMBERS * run.pulls.start + 3 * length..][..3 * length];
            for (index, pull) in self.all[run.pulls.clone()].iter().enumerate() {
                let change = [0, 1, 2].map(|axis| f64::from(sums[axis * length + index]));
                impulses[pull.receiver] += DVec3::from_array(change) * f64::from(pull.factor);
            }
        }
    }
}

/// The pulls of consecutive projections.
#[derive(Debug)]
pub(crate) struct PullsPart<'a> {
    /// By projection of the graph or the sheet, as in [`Pulls`].
    starts: &'a [u32],
    runs: &'a [Run],
    memory: &'a mut [f32],
    /// Index of the first pull in memory.
    first: usize,
}

/// The numbers of particles in memory.
#[derive(Clone, Copy)]
pub(crate) struct Numbers<'a> {
    pub(crate) part: &'a [f32],
    /// Where the part begins among the numbers of all.
    pub(crate) first: usize,
    /// Distance of the components of a vector.
    pub(crate) stride: usize,
}

impl<'a> PullsPart<'a> {
    /// Splits before a projection.
    pub(crate) fn split_at(self, projection: usize) -> (PullsPart<'a>, PullsPart<'a>) {
        let Self { starts, runs, memory, first } = self;
        let next = match starts.get(projection).and_then(|run| runs.get(*run as usize)) {
            Some(run) => run.pulls.start,
            None => first + memory.len() / NUMBERS,
        };
        let (before, behind) = memory.split_at_mut(NUMBERS * (next - first));
        let part = |memory, first| PullsPart { starts, runs, memory, first };
        (part(before, first), part(behind, next))
    }

    /// Returns true if a projection has pulls.
    #[inline(always)]
    pub(crate) fn has(&self, projection: usize) -> bool {
        self.starts.get(projection) < self.starts.get(projection + 1)
    }

    /// Notes the displacements before a projection.
    pub(crate) fn note(&mut self, projection: usize, numbers: Numbers<'_>) {
        for run in self.runs_of(projection) {
            let length = run.pulls.len();
            let noted = &mut self.memory[NUMBERS * (run.pulls.start - self.first)..][..3 * length];
            if let [x, y, z] = noted {
                [*x, *y, *z] = numbers.vector(run.at);
                continue;
            }
            for axis in 0..3 {
                noted[axis * length..][..length]
                    .copy_from_slice(numbers.along(axis, run.at, length));
            }
        }
    }

    /// Adds the changes since [`Self::note`].
    pub(crate) fn add_changes(&mut self, projection: usize, numbers: Numbers<'_>) {
        for run in self.runs_of(projection) {
            let length = run.pulls.len();
            let memory = &mut self.memory[NUMBERS * (run.pulls.start - self.first)..];
            let (noted, sums) = memory[..NUMBERS * length].split_at_mut(3 * length);
            if let [x, y, z] = sums {
                let after = numbers.vector(run.at);
                *x += after[0] - noted[0];
                *y += after[1] - noted[1];
                *z += after[2] - noted[2];
                continue;
            }
            for axis in 0..3 {
                let part = axis * length..(axis + 1) * length;
                let pairs = sums[part.clone()].iter_mut().zip(&noted[part]);
                for ((sum, before), after) in pairs.zip(numbers.along(axis, run.at, length)) {
                    *sum += after - before;
                }
            }
        }
    }

    #[inline(always)]
    fn runs_of(&self, projection: usize) -> &'a [Run] {
        match self.starts {
            [] => &[],
            starts => &self.runs[starts[projection] as usize..starts[projection + 1] as usize],
        }
    }
}

impl<'a> Numbers<'a> {
    #[inline(always)]
    fn vector(&self, at: usize) -> [f32; 3] {
        let (x, stride) = (at - self.first, self.stride);
        [self.part[x], self.part[x + stride], self.part[x + 2 * stride]]
    }

    #[inline(always)]
    fn along(&self, axis: usize, at: usize, length: usize) -> &'a [f32] {
        &self.part[at - self.first + axis * self.stride..][..length]
    }
}

/// The colliders and fixed particles on which forces are measured.
pub(crate) struct Receivers<'a> {
    pub(crate) collider_count: usize,
    /// By particle: its index among the fixed ones.
    pub(crate) of_particles: &'a [Option<u32>],
}

/// A tether as the store knows it.
pub(crate) struct TetherEnds {
    pub(crate) particle: u32,
    /// Number of nearer roots.
    pub(crate) slot: usize,
    pub(crate) root: u32,
}
