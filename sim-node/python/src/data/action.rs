//! Actions: the commands without their sender.

use std::path::{Path, PathBuf};

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde_json::{Map, Value};
use sim_contract::{
    ACTIONS, ActionInfo, ConstraintKind, FieldForm, FieldInfo, KindFilter, MovedObject, PathError,
    PathPoint, PlainF32, Text,
};
use sim_host::read_scene_file;
use sim_solver::Scene;
use sim_solver::scene::is_path;

use crate::arguments::whole;
use crate::convert::{Numbers, Vector, from_json, parameter_value};
use crate::error::load_error;

/// A command without its sender: `Action("grab", particle=3, target=(0, 1, 0))`, with the fields of recordings.
///
/// The static methods have the names and arguments of the methods of `Commands`, which describe them.
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

/// Converts an argument to the JSON form of a field.
fn field_value(field: &FieldInfo, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    match field.form {
        FieldForm::Whole => json(whole::<u32>(value, field.name, &(0..=u32::MAX))?),
        FieldForm::Long => json(whole::<u64>(value, field.name, &(0..=u64::MAX))?),
        FieldForm::Number => json(PlainF32(value.extract()?)),
        FieldForm::Flag => json(value.extract::<bool>()?),
        FieldForm::Vector => json(value.extract::<Vector>()?.0.map(PlainF32)),
        FieldForm::Rotation => json(value.extract::<Numbers<4>>()?.0.map(PlainF32)),
        FieldForm::Value => json(parameter_value(value)?),
        FieldForm::Kind => json(constraint_kind(value.extract()?)?),
        FieldForm::Text if field.name == "scene" => json(scene_text(&value.extract::<PathBuf>()?)?),
        FieldForm::Text => json(text(value.extract()?)?),
        FieldForm::Object | FieldForm::Contents | FieldForm::Hash => {
            json(value.extract::<String>()?)
        }
        FieldForm::Path => Err(PyTypeError::new_err("`Action.follow` makes the actions of a path")),
    }
}

fn json(value: impl Serialize) -> PyResult<Value> {
    serde_json::to_value(value).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Reads the JSON form of an action.
fn from_fields(fields: Map<String, Value>) -> PyResult<Action> {
    let kind = fields.get("kind").and_then(Value::as_str).unwrap_or_default();
    let meant = ActionInfo::meant(kind, fields.keys().map(String::as_str));
    serde_json::from_value(fields.into())
        .map(Action)
        .map_err(|error| PyValueError::new_err(format!("not an action: {error}{meant}")))
}

#[pymethods]
impl Action {
    #[new]
    #[pyo3(signature = (kind, /, **fields))]
    fn new(kind: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let row = ActionInfo::from_name(kind);
        let mut all = Map::from_iter([("kind".to_owned(), kind.into())]);
        for (name, value) in fields.into_iter().flatten() {
            let name: String = name.extract()?;
            let field = row.and_then(|row| row.fields.iter().find(|field| field.name == name));
            let is_given = field.is_none_or(|field| !field.is_optional || !value.is_none());
            if is_given {
                // An unknown name is refused with the nearest known one.
                let value = field.map(|field| field_value(field, &value)).transpose()?;
                all.insert(name, value.unwrap_or_default());
            }
        }
        from_fields(all)
    }

    #[classattr]
    #[pyo3(name = "KINDS")]
    fn kinds() -> Vec<&'static str> {
        ACTIONS.iter().map(|info| info.name).collect()
    }

    /// Returns the actions that lead an object along points, each a list of 4 or 8 numbers.
    #[staticmethod]
    #[pyo3(name = "_follow")]
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

    /// Returns the action as recordings store it.
    #[allow(clippy::wrong_self_convention, reason = "Python passes a reference")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.0)
    }

    /// Returns the action of a dict such as `Outcome.command`, or of a row of `Recording.outcomes()`.
    #[staticmethod]
    fn from_dict(fields: &Bound<'_, PyAny>) -> PyResult<Self> {
        let json = fields.py().import("json")?.call_method1("dumps", (fields,))?;
        let mut fields: Map<String, Value> = serde_json::from_str(json.extract()?)
            .map_err(|error| PyValueError::new_err(error.to_string()))?;
        fields.retain(|name, _| !ENVELOPE.contains(&name.as_str()));
        from_fields(fields)
    }

    fn __repr__(&self) -> String {
        format!("catenary.Action.from_dict({})", serde_json::to_string(&self.0).unwrap_or_default())
    }
}
