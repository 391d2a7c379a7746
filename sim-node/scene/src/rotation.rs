//! Poses relative to those at load, and rotations.

use glam::{DQuat, DVec3};

/// A frame relative to its pose at load, as a client gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Translation in the scene's unit.
    pub translation: [f32; 3],
    /// Quaternion x, y, z, w of any length except 0.
    pub rotation: [f32; 4],
}

/// The rotation by an angle in radians about a unit vector.
pub fn rotation_about(axis: DVec3, angle: f64) -> DQuat {
    let (sine, cosine) = sin_cos_of_half_turn(angle / 2.0);
    DQuat::from_xyzw(axis.x * sine, axis.y * sine, axis.z * sine, cosine)
}

/// Sine and cosine up to a common sign, which does not affect a rotation.
///
/// Those of the standard library may differ between machines; these are sums and products only. The
/// angle is reduced to [-pi/2, pi/2], where 12 terms of the Taylor series reach the last bit.
fn sin_cos_of_half_turn(angle: f64) -> (f64, f64) {
    use std::f64::consts::PI;
    let x = angle - (angle / PI).round() * PI;
    let (mut sine, mut cosine) = (0.0, 0.0);
    let mut term = 1.0;
    for power in 0..24_u8 {
        match power % 4 {
            0 => cosine += term,
            1 => sine += term,
            2 => cosine -= term,
            _ => sine -= term,
        }
        term *= x / (f64::from(power) + 1.0);
    }
    (sine, cosine)
}

#[cfg(test)]
mod tests {
    //! Sine and cosine against the functions of the standard library.
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_closed_form() {
        for angle in [-100.0_f64, -3.0, -1.5, -1e-9, 0.0, 0.3, 1.57, 1.58, 3.0, 50.0, 12345.6] {
            let (sine, cosine) = sin_cos_of_half_turn(angle);
            let sign = if cosine * angle.cos() + sine * angle.sin() < 0.0 { -1.0 } else { 1.0 };
            assert!((sign * sine - angle.sin()).abs() < 1e-11, "sin {angle}: {sine}");
            assert!((sign * cosine - angle.cos()).abs() < 1e-11, "cos {angle}: {cosine}");
        }
    }
}
