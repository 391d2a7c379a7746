//! Keyframes: a decoded one encodes to the same, and an accepted one is a state of its scene.
#![no_main]

use fuzz::simulation::{start, state};
use libfuzzer_sys::fuzz_target;
use sim_solver::{Keyframe, Particle};

// The first byte selects the scene. The particles of a snapshot follow, and then the keyframe.
fuzz_target!(|data: &[u8]| {
    let Some((first, rest)) = data.split_first() else { return };
    let (scene, mut pair) = start(*first);
    let size_bytes = size_of_val(pair.fast.particles());
    let Some((particles, keyframe)) = rest.split_at_checked(size_bytes) else { return };
    let Ok(mut keyframe) = Keyframe::decode(keyframe) else { return };
    check_encoding(&keyframe);
    let particles = particles.chunks_exact(size_of::<Particle>());
    let particles: Vec<Particle> = particles.map(bytemuck::pod_read_unaligned).collect();
    let before = pair.clone();
    if pair.both(|solver| solver.restore(&particles, &keyframe)).is_err() {
        assert!(state(&pair.fast) == state(&before.fast), "a refused keyframe changed the state");
        return;
    }
    // The solver does not know whether its node is paused.
    keyframe.paused = false;
    assert_eq!(pair.fast.keyframe(), keyframe);
    assert_eq!(pair.fast.particles(), particles);
    if pair.is_cheap() {
        pair.step();
        pair.check_restored(&scene);
    }
});

fn check_encoding(keyframe: &Keyframe) {
    let bytes = keyframe.encode();
    let again = Keyframe::decode(&bytes).expect("an encoded keyframe decodes");
    assert_eq!(again.encode(), bytes);
}
