//! Finds figures that have the same constraints between corresponding particles.

use std::collections::HashMap;

use sim_scene::model::Model;

use crate::constraints::order::ProjectionOrder;
use crate::store::graph::find_particle;

/// Fewest equal figures that are worth a crowd: fewer would leave lanes empty.
const FIGURES_MIN: usize = 8;

/// Connected parts of a scene, each with the same constraints between its particles. Their masses, lengths and
/// softness may differ.
#[derive(Debug, Clone, Default)]
pub(crate) struct Figures {
    /// Indices in the scene, figure by figure, ascending.
    pub(crate) particles: Vec<u32>,
    /// Indices in the scene, figure by figure, in the order of projection.
    pub(crate) constraints: Vec<u32>,
    /// By constraint of a figure: its two particles, as numbers within the figure.
    pub(crate) pairs: Vec<[u32; 2]>,
    /// Number of particles of a figure.
    pub(crate) size: usize,
}

/// A connected part of the scene.
#[derive(Default)]
struct Figure {
    particles: Vec<u32>,
    /// In the order of projection.
    constraints: Vec<u32>,
    /// It has nothing but distance constraints, which is all that a crowd can project.
    is_simple: bool,
}

impl Figures {
    pub(crate) fn count(&self) -> usize {
        self.particles.len() / self.size
    }

    /// Finds a particle of the scene: its figure, and its number within that.
    pub(crate) fn find(&self, particle: u32) -> Option<[usize; 2]> {
        let place = find_particle(&self.particles, particle)? as usize;
        Some([place / self.size, place % self.size])
    }

    fn push(&mut self, figure: &Figure) {
        self.particles.extend_from_slice(&figure.particles);
        self.constraints.extend_from_slice(&figure.constraints);
    }
}

/// Finds the equal figures among some particles, which must ascend and share no constraint with others.
pub(crate) fn find_figures(
    model: &Model,
    order: &ProjectionOrder,
    particles: &[u32],
) -> Vec<Figures> {
    if particles.len() < FIGURES_MIN {
        return Vec::new();
    }
    let (figures, numbers) = divide(model, order, particles);
    let mut found: Vec<Figures> = Vec::new();
    let mut known = HashMap::new();
    for figure in figures.iter().filter(|figure| figure.is_simple) {
        let number = |particle: u32| numbers[particle as usize];
        let pairs = figure.constraints.iter().map(|one| model.pair(*one).map(number));
        let form = (figure.particles.len(), pairs.collect::<Vec<_>>());
        let index = *known.entry(form).or_insert_with_key(|(size, pairs)| {
            let (size, pairs) = (*size, pairs.clone());
            found.push(Figures { pairs, size, ..Figures::default() });
            found.len() - 1
        });
        // The particles ascend, so one whose particles lie between those of others is left out.
        if found[index].particles.last() < figure.particles.first() {
            found[index].push(figure);
        }
    }
    found.retain(|figures| figures.count() >= FIGURES_MIN);
    found
}

/// Divides particles into figures, in the order of their first particles. Returns them, with the number of
/// each particle of the scene within its figure.
fn divide(model: &Model, order: &ProjectionOrder, particles: &[u32]) -> (Vec<Figure>, Vec<u32>) {
    let mut roots = Roots::new(model);
    let mut figures: Vec<Figure> = Vec::new();
    let mut numbers = vec![0; roots.0.len()];
    // By root: the index of its figure.
    let mut indices = vec![None; roots.0.len()];
    for particle in particles {
        let index = *indices[roots.find(*particle) as usize].get_or_insert_with(|| {
            figures.push(Figure { is_simple: true, ..Figure::default() });
            figures.len() - 1
        });
        let figure = &mut figures[index];
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
        let number = figure.particles.len() as u32;
        numbers[*particle as usize] = number;
        figure.particles.push(*particle);
    }
    let mut index_of = |particle: u32| indices[roots.find(particle) as usize];
    for constraint in &order.indices {
        if let Some(index) = index_of(model.pair(*constraint)[0]) {
            figures[index].constraints.push(*constraint);
        }
    }
    let bends = model.bends.iter().flat_map(|bend| bend.particles);
    for particle in model.triangles.as_flattened().iter().copied().chain(bends) {
        if let Some(index) = index_of(particle) {
            figures[index].is_simple = false;
        }
    }
    (figures, numbers)
}

/// By particle: another one of its figure, which leads to the first one.
struct Roots(Vec<u32>);

impl Roots {
    fn new(model: &Model) -> Self {
        let mut roots = Self((0..model.particle_count()).collect());
        for constraint in (0_u32..).take(model.constraints.len()) {
            roots.unite(model.pair(constraint));
        }
        for [a, b, c, d] in model.bends.iter().map(|bend| bend.particles) {
            for other in [b, c, d] {
                roots.unite([a, other]);
            }
        }
        roots
    }

    fn unite(&mut self, pair: [u32; 2]) {
        let [a, b] = pair.map(|particle| self.find(particle));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// First particle of a figure. It brings each particle on the way one step nearer.
    fn find(&mut self, mut particle: u32) -> u32 {
        while self.0[particle as usize] != particle {
            let next = self.0[particle as usize];
            self.0[particle as usize] = self.0[next as usize];
            particle = next;
        }
        particle
    }
}

#[cfg(test)]
mod tests {
    //! Figures that form a crowd, and others.
    use sim_scene::scene::{ConstraintOrder, Scene};

    use super::*;
    use crate::constraints::order::ProjectionOrders;

    /// Returns the figures of a scene with the numbers of their particles and their count.
    fn found(text: &str) -> Vec<(usize, usize)> {
        let model = Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap().model();
        let orders = ProjectionOrders::new(&model, ConstraintOrder::Grouped);
        let all: Vec<_> = (0..model.particle_count()).collect();
        let figures = find_figures(&model, &orders.constraints, &all);
        for one in &figures {
            assert!(one.particles.is_sorted(), "{:?}", one.particles);
            assert_eq!(one.constraints.len(), one.count() * one.pairs.len());
            for (place, constraint) in one.constraints.iter().enumerate() {
                let (figure, number) = (place / one.pairs.len(), place % one.pairs.len());
                let particle = |number: u32| one.particles[figure * one.size + number as usize];
                assert_eq!(model.pair(*constraint), one.pairs[number].map(particle));
            }
        }
        figures.iter().map(|one| (one.size, one.count())).collect()
    }

    fn particles(count: usize) -> String {
        let one = |index| format!("[[particle]]\nposition = [{index}, 0, 0]\n");
        (0..count).map(one).collect()
    }

    fn constraint(a: usize, b: usize) -> String {
        format!("[[constraint]]\nparticles = [{a}, {b}]\n")
    }

    /// Figures of three particles in a row.
    fn chains(count: usize) -> String {
        let chain = |first| constraint(first, first + 1) + &constraint(first + 1, first + 2);
        particles(3 * count) + &(0..count).map(|figure| chain(3 * figure)).collect::<String>()
    }

    #[test]
    fn eight_equal_figures_are_a_crowd() {
        assert_eq!(found(&chains(7)), []);
        assert_eq!(found(&chains(8)), [(3, 8)]);
        assert_eq!(found(&particles(9)), [(1, 9)]);
    }

    #[test]
    fn figures_of_other_constraints_are_left_out() {
        assert_eq!(found(&(chains(9) + &constraint(3, 5))), [(3, 8)]);
        assert_eq!(found(&(chains(10) + &constraint(0, 3))), [(3, 8)], "two become one");
        assert_eq!(
            found(&(chains(9) + "[[bend]]\nparticles = [0, 1, 2]\nrigidity = 1\n")),
            [(3, 8)]
        );
    }

    #[test]
    fn figures_that_lie_in_each_other_are_left_out() {
        let pairs: String = (0..10).map(|one| constraint(one, one + 10)).collect();
        assert_eq!(found(&(particles(20) + &pairs)), []);
    }

    #[test]
    fn generated_figures_are_found_and_surfaces_are_not() {
        let ragdoll = "[[generate]]\nshape = \"ragdoll\"\nheight = 1.7\n";
        assert_eq!(found(&ragdoll.repeat(8)), [(15, 8)]);
        let cloth = "[[generate]]\nshape = \"cloth\"\ncolumns = 2\nrows = 2\nspacing = 1\n";
        assert_eq!(found(&cloth.repeat(8)), []);
    }
}
