//! The measurement of forces in the graph.

use glam::DVec3;

use super::Graph;
use super::forces::{GraphForces, Projections};
use super::group::ConstraintGroup;
use crate::store::pulls::{Pull, Pulls};

impl Graph {
    /// Numbers of the projections of its groups.
    pub(crate) fn projections(&self) -> Projections {
        Projections::new(&self.groups, &self.bends.groups)
    }

    /// Measures these pulls in each further step.
    pub(crate) fn measure_forces(&mut self, pulls: Vec<Pull>, projections: Projections) {
        self.forces = GraphForces {
            pulls: Pulls::new(pulls, projections.count),
            projections,
            tether_pulls: vec![[0.0; 3]; self.tethers.len()],
            tether_receivers: vec![None; self.tethers.len()],
        };
    }

    pub(crate) fn forget_forces(&mut self) {
        self.forces = GraphForces::default();
    }

    /// Sets the root of a tether.
    pub(crate) fn set_tether_receiver(&mut self, index: usize, slot: usize, receiver: u32) {
        let tether = index * self.layout.scene.tethers + slot;
        self.forces.tether_receivers[tether] = Some(receiver);
    }

    /// Moves the impulses of a step, times the length of a substep, to those of the fixed particles.
    pub(crate) fn take_pulls(&mut self, impulses: &mut [DVec3]) {
        let GraphForces { pulls, tether_pulls, tether_receivers, .. } = &mut self.forces;
        pulls.take(impulses);
        for (pull, receiver) in tether_pulls.iter_mut().zip(tether_receivers) {
            if let Some(receiver) = receiver {
                impulses[*receiver as usize] += DVec3::from_array(pull.map(f64::from));
                *pull = [0.0; 3];
            }
        }
    }

    /// Number of the projection of the constraint at an index of its location.
    pub(crate) fn projection_of_constraint(&self, of: &Projections, index: usize) -> usize {
        number_of(&of.constraints, &self.groups, index)
    }

    /// Number of the projection of the bend at an index of its location.
    pub(crate) fn projection_of_bend(&self, of: &Projections, index: usize) -> usize {
        number_of(&of.bends, &self.bends.groups, index)
    }

    /// Where the x displacement of a particle is among the numbers of all.
    pub(crate) fn displacement_place(index: usize) -> usize {
        8 * index + 4
    }
}

fn number_of(firsts: &[usize], groups: &[ConstraintGroup], index: usize) -> usize {
    let group = groups.partition_point(|group| 8 * group.lane_groups.end <= index);
    let ConstraintGroup { lane_groups, is_independent, .. } = &groups[group];
    firsts[group] + if *is_independent { 0 } else { index - 8 * lane_groups.start }
}
