//! Small scenes, and comparisons of their complete state.

use sim_contract::{Parameter, ParticleFlags};
use sim_solver::{Kernels, Particle, Scene, Solver};

/// The scenes of the targets with a solver. The first byte of their input selects one.
pub const SCENES: [&str; 3] = [
    include_str!("../scenes/cloth.toml"),
    include_str!("../scenes/figure.toml"),
    include_str!("../scenes/planar.toml"),
];

/// Most passes over the constraints in a step that a target computes. More find nothing new, but
/// take long.
const PASSES_MAX: u32 = 64;

thread_local! {
    /// The scenes and their solvers, because reading a scene takes longer than a step.
    static STARTS: [(Scene, Pair); SCENES.len()] = SCENES.map(|text| {
        let scene = Scene::from_toml(text, "scene").expect("a scene of the targets is valid");
        let pair = Pair::new(&scene);
        (scene, pair)
    });
}

/// Returns the scene that a byte of the input selects, and its solvers.
pub fn start(byte: u8) -> (Scene, Pair) {
    STARTS.with(|starts| starts[usize::from(byte) % SCENES.len()].clone())
}

/// The complete state between two steps: the hash, the particles and the encoded keyframe.
pub fn state(solver: &Solver) -> (u64, &[u8], Vec<u8>) {
    let particles = bytemuck::cast_slice(solver.particles());
    (solver.state_hash(), particles, solver.keyframe().encode())
}

/// A solver with the fastest kernels and one with the reference kernels.
#[derive(Clone)]
pub struct Pair {
    /// The solver with the fastest kernels.
    pub fast: Solver,
    reference: Solver,
    is_planar: bool,
}

impl Pair {
    /// Makes the solvers of a scene.
    pub fn new(scene: &Scene) -> Self {
        Self {
            fast: Solver::new(scene),
            reference: Solver::with_kernels(scene, Kernels::Reference),
            is_planar: scene.dimensions == 2,
        }
    }

    /// Calls a function with both solvers. Both must return the same.
    pub fn both<T: std::fmt::Debug>(&mut self, mut call: impl FnMut(&mut Solver) -> T) -> T {
        let (fast, reference) = (call(&mut self.fast), call(&mut self.reference));
        crate::assert_same(&fast, &reference);
        fast
    }

    /// True if a step takes little time.
    pub fn is_cheap(&self) -> bool {
        let values = self.fast.parameter_values();
        let [substeps, iterations] =
            [Parameter::Substeps, Parameter::Iterations].map(|one| values.count(one));
        substeps.saturating_mul(iterations) <= PASSES_MAX
    }

    /// Makes a step of both solvers. The kernels produce the same bits, and no particle leaves the
    /// range of numbers or the plane of the scene.
    pub fn step(&mut self) {
        self.fast.step();
        self.reference.step();
        assert!(state(&self.fast) == state(&self.reference), "the kernels differ");
        for particle in self.fast.particles() {
            self.check_particle(particle);
        }
        assert!(self.fast.keyframe().encode().len() <= self.fast.keyframe_size_bytes_max());
    }

    fn check_particle(&self, particle: &Particle) {
        let Particle { position, velocity, inverse_mass, flags } = particle;
        let numbers = || position.iter().chain(velocity);
        assert!(numbers().all(|number| number.is_finite()), "{particle:?}");
        assert!(numbers().all(|number| number.to_bits() != (-0.0_f32).to_bits()), "{particle:?}");
        assert_eq!(*flags & ParticleFlags::ALL != 0, *inverse_mass == 0.0, "{particle:?}");
        assert!(!self.is_planar || (position[2], velocity[2]) == (0.0, 0.0), "{particle:?}");
    }

    /// Restores the state in solvers of the scene and makes a few steps. A restored state continues as
    /// the original does.
    pub fn check_restored(mut self, scene: &Scene) {
        let mut restored = Self::new(scene);
        let (particles, keyframe) = (self.fast.particles().to_vec(), self.fast.keyframe());
        restored
            .both(|solver| solver.restore(&particles, &keyframe))
            .expect("a state of the scene");
        for _ in 0..3 {
            assert!(state(&self.fast) == state(&restored.fast), "the restored state differs");
            self.step();
            restored.step();
        }
    }
}
