//! The camera: an orthographic projection, so that lengths stay comparable.

use glam::{DVec2, DVec3};
use sim_solver::scene::Up;

use super::extent::Extent;
use super::shape::Size;

/// Margin on each side, relative to the picture.
const MARGIN: f64 = 0.08;
/// A scene is flat along an axis if its extent there is less than this fraction of the longest one.
const FLAT: f64 = 0.01;
/// Sine and cosine of the 30 degrees by which the view `Iso` turns.
const TURN: (f64, f64) = (0.5, 0.866_025_403_784_438_6);
/// Sine and cosine of the 20 degrees by which it looks down.
const TILT: (f64, f64) = (0.342_020_143_325_668_7, 0.939_692_620_785_908_4);

/// The direction of view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// Along the depth axis, with x to the right and the scene's up axis up.
    Front,
    /// From the right-hand side of the front view.
    Side,
    /// From above.
    Top,
    /// Oblique: turned by 30 degrees, from 20 degrees above.
    Iso,
}

/// A right-handed orthonormal basis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basis {
    /// To the right in the picture.
    pub right: DVec3,
    /// Up in the picture.
    pub up: DVec3,
    /// From the scene to the viewer.
    pub toward: DVec3,
}

/// Maps points of the scene to pixels.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    basis: Basis,
    /// The center of the picture, in coordinates along right and up.
    center: DVec2,
    /// Pixels per unit of the scene.
    scale: f64,
    size: Size,
}

impl Basis {
    /// Returns the basis of a view of a scene.
    pub fn new(view: View, up: Up) -> Self {
        let front = Self::front(up);
        match view {
            View::Front => front,
            View::Side => Self { right: -front.toward, toward: front.right, ..front },
            View::Top => Self { up: -front.toward, toward: front.up, ..front },
            View::Iso => {
                let ((turn_sin, turn_cos), (tilt_sin, tilt_cos)) = (TURN, TILT);
                let right = front.right * turn_cos - front.toward * turn_sin;
                let level = front.toward * turn_cos + front.right * turn_sin;
                let toward = level * tilt_cos + front.up * tilt_sin;
                Self { right, up: toward.cross(right), toward }
            }
        }
    }

    fn front(up: Up) -> Self {
        let right = DVec3::X;
        let up = match up {
            Up::Y => DVec3::Y,
            Up::MinusY => DVec3::NEG_Y,
            Up::Z => DVec3::Z,
        };
        Self { right, up, toward: right.cross(up) }
    }
}

impl View {
    /// Returns the view along the axis in which the scene is flat, or else [`Self::Iso`].
    pub fn best_for(extent: &Extent, up: Up) -> Self {
        let size = extent.size();
        let is_along_flat_axis = |view: &Self| {
            let depth = Basis::new(*view, up).toward.abs().dot(size);
            depth < FLAT * size.max_element()
        };
        [Self::Front, Self::Side, Self::Top]
            .into_iter()
            .find(is_along_flat_axis)
            .unwrap_or(Self::Iso)
    }
}

impl Camera {
    /// Fits `extent` into the picture.
    pub fn fit(basis: Basis, extent: &Extent, size: Size) -> Self {
        let flat = |point: DVec3| DVec2::new(point.dot(basis.right), point.dot(basis.up));
        let corners = extent.corners().map(flat);
        let min = corners.into_iter().fold(corners[0], DVec2::min);
        let max = corners.into_iter().fold(corners[0], DVec2::max);
        let room = DVec2::new(size.width.into(), size.height.into()) * (1.0 - 2.0 * MARGIN);
        // The extent of a single point is 0. It gets one unit of space around it.
        let scale = (room / (max - min)).min_element();
        let scale = if scale.is_finite() { scale } else { room.min_element() };
        Self { basis, center: (min + max) * 0.5, scale, size }
    }

    /// Returns the pixel coordinates of a point.
    pub(crate) fn project(&self, point: DVec3) -> DVec2 {
        let Basis { right, up, .. } = self.basis;
        let away = (DVec2::new(point.dot(right), point.dot(up)) - self.center) * self.scale;
        let middle = DVec2::new(self.size.width.into(), self.size.height.into()) * 0.5;
        middle + DVec2::new(away.x, -away.y)
    }

    /// Returns the depth coordinate of a point, which is larger for nearer points.
    pub(crate) fn nearness(&self, point: DVec3) -> f64 {
        point.dot(self.basis.toward)
    }

    /// Converts a length of the scene to pixels.
    pub(crate) fn pixels(&self, length: f64) -> f64 {
        length * self.scale
    }

    /// Returns the brightness of a two-sided face with this unit normal, 0..=1. The light comes from
    /// the upper left behind the viewer.
    pub(crate) fn brightness(&self, normal: DVec3) -> f64 {
        let Basis { right, up, toward } = self.basis;
        let light = (toward * 0.8 + up * 0.5 - right * 0.3).normalize();
        0.55 + 0.45 * normal.dot(light).abs()
    }

    /// Returns `true` if a face with this normal faces the viewer.
    pub(crate) fn is_facing(&self, normal: DVec3) -> bool {
        normal.dot(self.basis.toward) > 1e-9
    }

    /// Returns the factor for line widths: 1 in a picture of 720 pixels. It has a minimum, so that
    /// lines stay visible in small pictures.
    pub(crate) fn line_scale(&self) -> f64 {
        (f64::from(self.size.width.min(self.size.height)) / 720.0).max(0.6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { width: 200, height: 100 };

    fn cube() -> Extent {
        Extent { min: DVec3::ZERO, max: DVec3::ONE }
    }

    fn place(view: View, up: Up, point: [f64; 3]) -> [f64; 2] {
        let camera = Camera::fit(Basis::new(view, up), &cube(), SIZE);
        (camera.project(DVec3::from_array(point)).to_array()).map(|one| (one * 1e9).round() / 1e9)
    }

    /// The unit cube is 84 pixels high in a picture of 200 x 100: from x 58 to 142, y 8 to 92.
    #[test]
    fn the_corners_of_the_unit_cube_project_to_the_expected_pixels() {
        for (view, up, corner, expected) in [
            (View::Front, Up::Y, [0.0, 0.0, 0.0], [58.0, 92.0]),
            (View::Front, Up::Y, [1.0, 1.0, 1.0], [142.0, 8.0]),
            (View::Front, Up::MinusY, [0.0, 0.0, 0.0], [58.0, 8.0]),
            (View::Front, Up::Z, [1.0, 0.0, 1.0], [142.0, 8.0]),
            // From the right, near points are on the left.
            (View::Side, Up::Y, [0.0, 1.0, 1.0], [58.0, 8.0]),
            (View::Side, Up::Z, [0.0, 0.0, 1.0], [58.0, 8.0]),
            // From above, near points are at the bottom.
            (View::Top, Up::Y, [0.0, 0.0, 1.0], [58.0, 92.0]),
            (View::Top, Up::Z, [1.0, 1.0, 0.0], [142.0, 8.0]),
        ] {
            assert_eq!(place(view, up, corner), expected, "{view:?} {up:?} {corner:?}");
        }
    }

    /// Turned by 30 and tilted by 20 degrees, the cube is cos 20 + (sin 30 + cos 30) sin 20 high.
    #[test]
    fn the_oblique_view_shows_the_cube_turned_and_tilted() {
        let (turn, tilt) = (30_f64.to_radians(), 20_f64.to_radians());
        let scale = 84.0 / (tilt.cos() + (turn.sin() + turn.cos()) * tilt.sin());
        let camera = Camera::fit(Basis::new(View::Iso, Up::Y), &cube(), SIZE);
        let origin = camera.project(DVec3::ZERO);
        for (axis, x, y) in [
            (DVec3::X, turn.cos(), -turn.sin() * tilt.sin()),
            (DVec3::Y, 0.0, tilt.cos()),
            (DVec3::Z, -turn.sin(), -turn.cos() * tilt.sin()),
        ] {
            let expected = origin + DVec2::new(x, -y) * scale;
            let pixel = camera.project(axis);
            assert!((pixel - expected).length() < 1e-9, "{axis}: {pixel}, not {expected}");
        }
        assert!((camera.project(DVec3::ONE * 0.5) - DVec2::new(100.0, 50.0)).length() < 1e-9);
    }

    #[test]
    fn every_basis_is_right_handed() {
        for view in [View::Front, View::Side, View::Top, View::Iso] {
            for up in [Up::Y, Up::MinusY, Up::Z] {
                let Basis { right, up, toward } = Basis::new(view, up);
                assert!((right.cross(up) - toward).length() < 1e-12, "{view:?}");
                assert!((toward.length() - 1.0).abs() < 1e-12, "{view:?}");
            }
        }
    }

    #[test]
    fn flat_scenes_are_viewed_along_their_flat_axis_and_others_obliquely() {
        let view = |x, y, z, up| {
            View::best_for(&Extent { min: DVec3::ZERO, max: DVec3::new(x, y, z) }, up)
        };
        assert_eq!(view(2.0, 3.0, 0.01, Up::Y), View::Front);
        assert_eq!(view(0.01, 3.0, 2.0, Up::Y), View::Side);
        assert_eq!(view(2.0, 0.01, 3.0, Up::Y), View::Top);
        assert_eq!(view(2.0, 3.0, 0.01, Up::Z), View::Top);
        assert_eq!(view(2.0, 3.0, 0.1, Up::Y), View::Iso);
        assert_eq!(view(1.0, 0.0, 0.0, Up::Y), View::Front, "a line");
        assert_eq!(view(0.0, 0.0, 1.0, Up::Y), View::Side, "a line along the depth");
    }

    #[test]
    fn lines_and_points_fit_too() {
        let fit = |max: DVec3| {
            let extent = Extent { min: DVec3::ZERO, max };
            Camera::fit(Basis::new(View::Front, Up::Y), &extent, SIZE)
        };
        assert_eq!(fit(DVec3::X).project(DVec3::X), DVec2::new(184.0, 50.0));
        assert_eq!(fit(DVec3::ZERO).project(DVec3::ZERO), DVec2::new(100.0, 50.0));
        assert_eq!(fit(DVec3::ZERO).pixels(1.0), 84.0);
    }
}
