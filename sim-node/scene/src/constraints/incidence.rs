//! The constraints and bends of each particle.

use super::Constraint;
use super::bends::Bend;

/// The constraints and bends of each particle, by their numbers: bends are numbered after the constraints.
#[derive(Debug, Clone)]
pub struct Incidence {
    /// By particle: index of its first number in `numbers`. One more entry at the end.
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

impl Incidence {
    pub(crate) fn new(particle_count: usize, constraints: &[Constraint], bends: &[Bend]) -> Self {
        let of_constraints = || constraints.iter().map(|one| [one.a, one.b]);
        let of_bends = || {
            let ends = |bend: &Bend| bend.particles.into_iter().zip(bend.coefficients);
            bends.iter().map(move |bend| ends(bend).filter(|(_, share)| *share != 0.0))
        };
        let all = |add: &mut dyn FnMut(u32, u32)| {
            let mut number = 0;
            for ends in of_constraints() {
                for particle in ends {
                    add(particle, number);
                }
                number += 1;
            }
            for ends in of_bends() {
                for (particle, _) in ends {
                    add(particle, number);
                }
                number += 1;
            }
        };
        let mut starts = vec![0_u32; particle_count + 1];
        all(&mut |particle, _| starts[particle as usize + 1] += 1);
        for particle in 0..particle_count {
            starts[particle + 1] += starts[particle];
        }
        let mut next = starts.clone();
        let mut numbers = vec![0; starts[particle_count] as usize];
        all(&mut |particle, number| {
            let place = &mut next[particle as usize];
            numbers[*place as usize] = number;
            *place += 1;
        });
        Self { starts, numbers }
    }

    /// Numbers of the constraints and bends of a particle.
    pub fn of(&self, particle: u32) -> &[u32] {
        let particle = particle as usize;
        &self.numbers[self.starts[particle] as usize..self.starts[particle + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use crate::Scene;

    #[test]
    fn each_particle_has_its_constraints_and_then_its_bends() {
        let text = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 4\nrows = 3\nspacing = 0.1\n\
            bending = 1e-4\n[[particle]]\nposition = [9, 9, 9]\n";
        let model = Scene::from_toml(text, "test").unwrap().model();
        let incidence = model.incidence();
        assert!(!model.bends.is_empty());
        for particle in 0..u32::try_from(model.particles.len()).unwrap() {
            let ends = |index: u32| model.pair(index).contains(&particle);
            let constraint_count = u32::try_from(model.constraints.len()).unwrap();
            let mut expected: Vec<_> = (0..constraint_count).filter(|index| ends(*index)).collect();
            for (number, bend) in (constraint_count..).zip(&model.bends) {
                let mut ends = bend.particles.iter().zip(bend.coefficients);
                if ends.any(|(end, share)| *end == particle && share != 0.0) {
                    expected.push(number);
                }
            }
            assert_eq!(incidence.of(particle), expected, "{particle}");
        }
    }
}
