//! Cuts: one constraint, all around a point, all that cross the way of a cursor.

use glam::{DVec3, Vec3};

use crate::{COORDINATE_MAX, Constraint, Rejection, Solver, TearCause, check_finite, is_near};

/// The way of a cursor, extended along the direction of view: a strip that cuts what crosses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Where the cursor was.
    pub from: [f32; 3],
    /// Where it is.
    pub to: [f32; 3],
    /// The strip extends along this, both ways; of any length but 0.
    pub direction: [f32; 3],
}

/// All that is nearer to a point than a radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its middle.
    pub center: [f32; 3],
    /// >= 0.
    pub radius: f32,
}

impl Solver {
    /// Tears one constraint.
    ///
    /// # Errors
    /// Unknown, or torn already.
    pub fn cut(&mut self, constraint: u32) -> Result<(), Rejection> {
        if constraint as usize >= self.constraint_count() {
            return Err(Rejection::UnknownConstraint);
        }
        if self.torn.is_torn(constraint) {
            return Err(Rejection::AlreadyTorn);
        }
        self.tear(constraint, TearCause::Cut);
        self.tethers.drop_torn(&self.torn, &mut self.store);
        Ok(())
    }

    /// Tears every constraint that has an end strictly within a ball.
    ///
    /// # Errors
    /// A wrong number.
    pub fn cut_radius(&mut self, ball: Ball) -> Result<(), Rejection> {
        self.check_ball(&ball)?;
        self.tear_all(|a, b| ball.has(a) || ball.has(b));
        Ok(())
    }

    /// Tears every constraint that crosses a strip. One that lies in it, or a sweep that covers
    /// nothing, does not cross.
    ///
    /// # Errors
    /// A wrong number, or no direction.
    pub fn cut_segment(&mut self, sweep: Sweep) -> Result<(), Rejection> {
        let Sweep { from, to, direction } = sweep;
        for vector in [from, to, direction] {
            check_finite(&vector)?;
        }
        let is_near = is_near(&from) && is_near(&to) && is_near(&direction);
        let leaves_plane = self.is_planar && (from[2] != 0.0 || to[2] != 0.0);
        if !is_near || leaves_plane || direction == [0.0; 3] {
            return Err(Rejection::OutOfRange);
        }
        let strip = Strip::new(&sweep);
        self.tear_all(|a, b| strip.is_crossed(a, b));
        Ok(())
    }

    pub(crate) fn check_ball(&self, ball: &Ball) -> Result<(), Rejection> {
        check_finite(&ball.center)?;
        check_finite(&[ball.radius])?;
        let is_near = is_near(&ball.center);
        let is_in_plane = !self.is_planar || ball.center[2] == 0.0;
        let is_size = (0.0..=COORDINATE_MAX).contains(&ball.radius);
        if is_near && is_in_plane && is_size { Ok(()) } else { Err(Rejection::OutOfRange) }
    }

    /// Tears what is whole and meets a condition on its two ends.
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

impl Ball {
    pub(crate) fn has(&self, point: Vec3) -> bool {
        let arm = point - Vec3::from_array(self.center);
        arm.dot(arm) < self.radius * self.radius
    }
}

/// A strip: from a point along one side, and both ways along another direction.
struct Strip {
    from: DVec3,
    /// Of the plane of the strip; 0 where the strip covers nothing.
    normal: DVec3,
    /// The part of the side that is across the direction.
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

    /// Touching counts.
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
