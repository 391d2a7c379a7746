//! Actions: the commands without their sender.

use std::path::{Path, PathBuf};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sim_contract::{
    ActionInfo, ConstraintKind, GRAB_OVER_S_DEFAULT, KindFilter, MovedObject, PathError, PathPoint,
    Text, read_scene_file,
};
use sim_solver::Scene;
use sim_solver::scene::is_path;

use crate::arguments;
use crate::convert::{Quaternion, Vector, from_json, parameter_value};
use crate::error::load_error;

/// A command without its sender. The methods of `Commands` describe each of them.
#[pyclass(frozen, eq, module = "catenary")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Action(pub(crate) sim_contract::Action);

/// The fields of a recorded outcome that its action does not have.
const ENVELOPE: [&str; 8] =
    ["step", "client_id", "sequence", "index", "status", "reason", "disconnected", "new_run"];

fn text(text: &str) -> PyResult<Text> {
    Text::new(text).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Returns a scene as the node finds it, whose working directory may differ from this one. Checks it first, because an
/// outcome has no room for the place of an error.
fn scene_text(scene: &Path) -> PyResult<Text> {
    let name = scene.to_string_lossy();
    let read = |path: &Path| read_scene_file(path).map_err(|error| error.to_string());
    Scene::load(&name, &read).map_err(|error| load_error(&error))?;
    if is_path(&name) {
        return text(&std::path::absolute(scene)?.to_string_lossy());
    }
    text(&name)
}

fn constraint_kind(name: &str) -> PyResult<KindFilter> {
    ConstraintKind::from_name(name).map(KindFilter::Known).ok_or_else(|| {
        let names = ConstraintKind::ALL.map(ConstraintKind::name).join(", ");
        PyValueError::new_err(format!("there is no kind of constraint '{name}' (allowed: {names})"))
    })
}

#[pymethods]
impl Action {
    #[staticmethod]
    fn pin(#[pyo3(from_py_with = arguments::particle)] particle: u32) -> Self {
        Self(sim_contract::Action::Pin { particle })
    }

    #[staticmethod]
    fn unpin(#[pyo3(from_py_with = arguments::particle)] particle: u32) -> Self {
        Self(sim_contract::Action::Unpin { particle })
    }

    #[staticmethod]
    #[pyo3(signature = (particle, target, over=GRAB_OVER_S_DEFAULT))]
    fn grab(
        #[pyo3(from_py_with = arguments::particle)] particle: u32,
        target: Vector,
        over: f32,
    ) -> Self {
        Self(sim_contract::Action::Grab { particle, target: target.0, over_s: over })
    }

    #[staticmethod]
    #[pyo3(name = "move", signature = (particle, target, over=GRAB_OVER_S_DEFAULT))]
    fn move_grabbed(
        #[pyo3(from_py_with = arguments::particle)] particle: u32,
        target: Vector,
        over: f32,
    ) -> Self {
        Self(sim_contract::Action::Move { particle, target: target.0, over_s: over })
    }

    #[staticmethod]
    #[pyo3(signature = (particle, *, force=false))]
    fn release(#[pyo3(from_py_with = arguments::particle)] particle: u32, force: bool) -> Self {
        Self(sim_contract::Action::Release { particle, force })
    }

    #[staticmethod]
    #[pyo3(signature = (center, radius, delta, *, limit=None))]
    fn push(center: Vector, radius: f32, delta: Vector, limit: Option<f32>) -> Self {
        Self(sim_contract::Action::Push { center: center.0, radius, delta: delta.0, limit })
    }

    #[staticmethod]
    fn cut(#[pyo3(from_py_with = arguments::constraint)] constraint: u32) -> Self {
        Self(sim_contract::Action::Cut { constraint })
    }

    #[staticmethod]
    fn cut_radius(center: Vector, radius: f32) -> Self {
        Self(sim_contract::Action::CutRadius { center: center.0, radius })
    }

    #[staticmethod]
    #[pyo3(signature = (start, end, direction=Vector::Z))]
    fn cut_segment(start: Vector, end: Vector, direction: Vector) -> Self {
        let (from, to, direction) = (start.0, end.0, direction.0);
        Self(sim_contract::Action::CutSegment { from, to, direction })
    }

    #[staticmethod]
    #[pyo3(signature = (anchor, translation, rotation=Quaternion::IDENTITY, over=0.0))]
    fn move_anchor(
        #[pyo3(from_py_with = arguments::anchor)] anchor: u32,
        translation: Vector,
        rotation: Quaternion,
        over: f32,
    ) -> Self {
        let (translation, rotation) = (translation.0, rotation.0);
        Self(sim_contract::Action::MoveAnchor { anchor, translation, rotation, over_s: over })
    }

    #[staticmethod]
    #[pyo3(signature = (collider, translation, rotation=Quaternion::IDENTITY, over=0.0))]
    fn move_collider(
        #[pyo3(from_py_with = arguments::collider)] collider: u32,
        translation: Vector,
        rotation: Quaternion,
        over: f32,
    ) -> Self {
        let (translation, rotation) = (translation.0, rotation.0);
        Self(sim_contract::Action::MoveCollider { collider, translation, rotation, over_s: over })
    }

    /// Returns the actions that lead an object along points, each a list of 4 or 8 numbers.
    #[staticmethod]
    #[pyo3(signature = (object, index, path, append=false))]
    fn follow(object: &str, index: u32, path: Vec<Vec<f64>>, append: bool) -> PyResult<Vec<Self>> {
        let object = MovedObject::from_name(object).ok_or_else(|| {
            let allowed = MovedObject::ALL.map(MovedObject::name).join(", ");
            PyValueError::new_err(format!("'{object}' cannot move (allowed: {allowed})"))
        })?;
        let point = |(index, row): (usize, &Vec<f64>)| {
            PathPoint::from_row(row).map_err(|fault| PathError::Point { index, fault })
        };
        let points: Result<Vec<_>, _> = path.iter().enumerate().map(point).collect();
        let actions = points
            .and_then(|points| sim_contract::Action::follow(object, index, &points, append))
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(actions.into_iter().map(Self).collect())
    }

    #[staticmethod]
    #[pyo3(signature = (
        collider,
        translation,
        rotation=Quaternion::IDENTITY,
        velocity=Vector::ZERO,
        angular_velocity=Vector::ZERO,
        force=Vector::ZERO,
        torque=Vector::ZERO,
    ))]
    #[allow(clippy::too_many_arguments, reason = "these are the keywords of Python")]
    fn drive_body(
        #[pyo3(from_py_with = arguments::collider)] collider: u32,
        translation: Vector,
        rotation: Quaternion,
        velocity: Vector,
        angular_velocity: Vector,
        force: Vector,
        torque: Vector,
    ) -> Self {
        Self(sim_contract::Action::DriveBody {
            collider,
            translation: translation.0,
            rotation: rotation.0,
            velocity: velocity.0,
            angular_velocity: angular_velocity.0,
            force: force.0,
            torque: torque.0,
        })
    }

    #[staticmethod]
    #[pyo3(signature = (parameter, value, kind=None, block=None, collider=None))]
    fn set(
        parameter: &str,
        value: &Bound<'_, PyAny>,
        kind: Option<&str>,
        block: Option<u32>,
        collider: Option<u32>,
    ) -> PyResult<Self> {
        Ok(Self(sim_contract::Action::Set {
            parameter: text(parameter)?,
            value: parameter_value(value)?,
            constraint_kind: kind.map(constraint_kind).transpose()?,
            block,
            collider,
        }))
    }

    #[staticmethod]
    fn load(scene: PathBuf) -> PyResult<Self> {
        Ok(Self(sim_contract::Action::Load { scene: scene_text(&scene)? }))
    }

    #[staticmethod]
    fn pause() -> Self {
        Self(sim_contract::Action::Pause)
    }

    #[staticmethod]
    fn resume() -> Self {
        Self(sim_contract::Action::Resume)
    }

    #[staticmethod]
    #[pyo3(signature = (count=1))]
    fn step(#[pyo3(from_py_with = arguments::node_steps)] count: u32) -> Self {
        Self(sim_contract::Action::Step { count })
    }

    #[staticmethod]
    fn reset() -> Self {
        Self(sim_contract::Action::Reset)
    }

    #[staticmethod]
    #[pyo3(signature = (*, to_step=None, back_steps=None))]
    fn rewind(
        #[pyo3(from_py_with = arguments::to_step)] to_step: Option<u64>,
        #[pyo3(from_py_with = arguments::back_steps)] back_steps: Option<u32>,
    ) -> PyResult<Self> {
        if to_step.is_some() == back_steps.is_some() {
            return Err(PyValueError::new_err("give either `to_step` or `back_steps`"));
        }
        Ok(Self(sim_contract::Action::Rewind { to_step, back_steps }))
    }

    #[staticmethod]
    #[pyo3(name = "mark")]
    fn mark_step(text: &str) -> PyResult<Self> {
        Ok(Self(sim_contract::Action::Mark { text: self::text(text)? }))
    }

    /// Returns the action as recordings store it.
    #[allow(clippy::wrong_self_convention, reason = "Python passes a reference")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.0)
    }

    /// Returns the action of a dict such as `Outcome.command`, or of a row of `Recording.outcomes()`.
    #[staticmethod]
    fn from_dict(fields: &Bound<'_, PyAny>) -> PyResult<Self> {
        let json = fields.py().import("json")?.call_method1("dumps", (fields,))?;
        let mut fields: serde_json::Value = serde_json::from_str(json.extract()?)
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        if let Some(fields) = fields.as_object_mut() {
            fields.retain(|name, _| !ENVELOPE.contains(&name.as_str()));
        }
        let meant = fields.as_object().map_or_else(String::new, |fields| {
            let kind = fields.get("kind").and_then(serde_json::Value::as_str).unwrap_or_default();
            ActionInfo::meant(kind, fields.keys().map(String::as_str))
        });
        let action = serde_json::from_value(fields);
        action
            .map(Self)
            .map_err(|error| PyValueError::new_err(format!("not an action: {error}{meant}")))
    }

    fn __repr__(&self) -> String {
        format!("catenary.Action.from_dict({})", serde_json::to_string(&self.0).unwrap_or_default())
    }
}
