//! Cuts: a single constraint, all around a point, or all that cross the path of a cursor.

use glam::{DVec3, Vec3};
use sim_scene::constraints::Constraint;

use sim_types::{Action, Reason, TearCause};

use crate::solver::Solver;

/// The path of a cursor, extended along the direction of view to a strip that cuts the constraints
/// that cross it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Previous position of the cursor.
    pub from: [f32; 3],
    /// Current position of the cursor.
    pub to: [f32; 3],
    /// Direction in which the strip extends, both ways; not 0.
    pub direction: [f32; 3],
}

/// All points nearer to the center than the radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Center.
    pub center: [f32; 3],
    /// Radius, >= 0.
    pub radius: f32,
}

impl Solver {
    /// Tears one constraint.
    ///
    /// # Errors
    /// The constraint is unknown or already torn.
    pub fn cut(&mut self, constraint: u32) -> Result<(), Reason> {
        self.assert_whole();
        if constraint as usize >= self.constraint_count() {
            return Err(Reason::UnknownConstraint);
        }
        if self.torn.is_torn(constraint) {
            return Err(Reason::AlreadyTorn);
        }
        self.tear(constraint, TearCause::Cut);
        self.tethers.drop_torn(&self.torn, &mut self.store);
        Ok(())
    }

    /// Tears every constraint with an end strictly inside a sphere.
    ///
    /// # Errors
    /// A number is not finite or out of range.
    pub fn cut_radius(&mut self, sphere: Sphere) -> Result<(), Reason> {
        self.assert_whole();
        let Sphere { center, radius } = sphere;
        Action::CutRadius { center, radius }.validate()?;
        self.check_in_plane(&[center])?;
        self.tear_all(|a, b| sphere.contains(a) || sphere.contains(b));
        Ok(())
    }

    /// Tears every constraint that crosses a strip. A constraint within the plane of the strip does
    /// not cross it, and nothing crosses a strip without area.
    ///
    /// # Errors
    /// A number is not finite or out of range, or the direction is 0.
    pub fn cut_segment(&mut self, sweep: Sweep) -> Result<(), Reason> {
        self.assert_whole();
        let Sweep { from, to, direction } = sweep;
        Action::CutSegment { from, to, direction }.validate()?;
        self.check_in_plane(&[from, to])?;
        let strip = Strip::new(&sweep);
        self.tear_all(|a, b| strip.is_crossed(a, b));
        Ok(())
    }

    /// Tears the constraints whose ends meet a condition, unless they are torn.
    fn tear_all(&mut self, is_cut: impl Fn(Vec3, Vec3) -> bool) {
        for index in 0..self.model.constraints.len() {
            let Constraint { a, b, .. } = self.model.constraints[index];
            let [a, b] = [a, b].map(|particle| {
                Vec3::from_array(self.particles.states[particle as usize].position)
            });
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 constraints")]
            let index = index as u32;
            if !self.torn.is_torn(index) && is_cut(a, b) {
                self.tear(index, TearCause::Cut);
            }
        }
        self.tethers.drop_torn(&self.torn, &mut self.store);
    }
}

impl Sphere {
    pub(crate) fn contains(&self, point: Vec3) -> bool {
        let arm = point - Vec3::from_array(self.center);
        arm.dot(arm) < self.radius * self.radius
    }
}

/// A strip: from a point along one side, and both ways along a direction.
struct Strip {
    from: DVec3,
    /// Normal of the plane of the strip; 0 if the strip has no area.
    normal: DVec3,
    /// Component of the side perpendicular to the direction.
    across: DVec3,
}

impl Strip {
    fn new(sweep: &Sweep) -> Self {
        let vector = |axes: [f32; 3]| Vec3::from_array(axes).as_dvec3();
        let (from, direction) = (vector(sweep.from), vector(sweep.direction));
        let side = vector(sweep.to) - from;
        let across = side - direction * (side.dot(direction) / direction.dot(direction));
        Self { from, normal: side.cross(direction), across }
    }

    /// True if the segment from `a` to `b` crosses or touches the strip.
    fn is_crossed(&self, a: Vec3, b: Vec3) -> bool {
        let (a, b) = (a.as_dvec3() - self.from, b.as_dvec3() - self.from);
        let (above, below) = (a.dot(self.normal), b.dot(self.normal));
        if above * below > 0.0 || above == below {
            return false;
        }
        let crossing = a + (b - a) * (above / (above - below));
        let share = crossing.dot(self.across);
        (0.0..=self.across.dot(self.across)).contains(&share)
    }
}
