//! Who works on the bodies, and with what.

use crate::contact::Contacts;
use crate::crew::{Crew, MEMBERS_MAX};
use crate::kernels::Kernels;
use crate::project::Block;

/// The threads, the kernels that they use, and what each of them needs for itself.
#[derive(Debug, Clone)]
pub(crate) struct Team {
    pub(crate) kernels: Kernels,
    crew: Crew,
    scratches: Vec<Scratch>,
}

/// What a member needs for itself.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    pub(crate) contacts: Contacts,
    pub(crate) block: Box<Block>,
}

impl Team {
    pub(crate) fn new(kernels: Kernels, members: usize) -> Self {
        let crew = Crew::new(members);
        let scratches = vec![Scratch::default(); crew.members()];
        Self { kernels, crew, scratches }
    }

    pub(crate) fn members(&self) -> usize {
        self.crew.members()
    }

    /// Makes room for contacts of so many particles side by side.
    pub(crate) fn make_room(&mut self, contact_count: usize) {
        for scratch in &mut self.scratches {
            scratch.contacts = Contacts::new(contact_count);
        }
    }

    /// For work that one does alone.
    pub(crate) fn alone(&mut self) -> &mut Scratch {
        &mut self.scratches[0]
    }

    /// Lets each member work on a part, with its own scratch; one alone takes them in turn.
    ///
    /// # Panics
    /// If there are more parts than members.
    pub(crate) fn each<P: Send>(
        &mut self,
        mut parts: impl Iterator<Item = P>,
        work: impl Fn(&mut P, &mut Scratch) + Sync,
        mut done: impl FnMut(P),
    ) {
        let (first, second) = (parts.next(), parts.next());
        let is_alone = self.members() == 1 || second.is_none();
        let parts = first.into_iter().chain(second).chain(parts);
        if is_alone {
            for mut part in parts {
                work(&mut part, &mut self.scratches[0]);
                done(part);
            }
            return;
        }
        let mut pairs = [const { None }; MEMBERS_MAX];
        let (mut count, mut scratches) = (0, self.scratches.iter_mut());
        for (part, place) in parts.zip(&mut pairs) {
            let scratch = scratches.next();
            assert!(scratch.is_some(), "more parts than members");
            *place = scratch.map(|scratch| (part, scratch));
            count += 1;
        }
        let pairs = &mut pairs[..count];
        self.crew.each(pairs, |pair| {
            if let Some((part, scratch)) = pair {
                work(part, scratch);
            }
        });
        for (part, _) in pairs.iter_mut().filter_map(Option::take) {
            done(part);
        }
    }
}
