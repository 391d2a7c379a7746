//! The key `body` of a `[[collider]]`.

use serde::Deserialize;
use sim_types::NumberRange;

use super::reader::{MASS, Reader};
use super::value::{Number, Spanned, Table, TableKeys, Vector};
use crate::scene::definition::collider::ColliderBody;
use crate::scene::error::SceneError;

/// Moments of inertia that a solid cannot have are refused up to this share, for rounded numbers.
const ROUNDING: f32 = 1e-3;

/// A moment of inertia.
const INERTIA: NumberRange = NumberRange { text: "1e-38 to 1e38 kg unit^2", ..MASS };

/// The table of a body.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileBody {
    mass: Option<Number>,
    inertia: Option<Vector>,
}

impl TableKeys for FileBody {
    const FORM: &'static str = "a table { mass, inertia }";
}

impl Reader<'_> {
    /// Checks the body of a collider.
    pub(super) fn body(
        &self,
        field: &impl Fn(&str) -> String,
        table: &Spanned<Table<FileBody>>,
    ) -> Result<ColliderBody, SceneError> {
        let file = table.get_ref();
        let (mass_field, inertia_field) = (field("body.mass"), field("body.inertia"));
        let mass = self.required(file.mass.as_ref(), table.span(), &mass_field, MASS.text)?;
        let three = "three numbers > 0";
        let vector = self.required(file.inertia.as_ref(), table.span(), &inertia_field, three)?;
        let mut inertia = [0.0; 3];
        for (moment, number) in inertia.iter_mut().zip(vector.get_ref().iter()) {
            *moment = self.ranged(&inertia_field, number, INERTIA)?;
        }
        let [x, y, z] = inertia;
        let largest = x.max(y).max(z);
        // No moment exceeds the sum of the others. In 2 dimensions only the last one matters.
        if !self.is_planar && largest > (1.0 + ROUNDING) * (x + y + z - largest) {
            let problem =
                "no solid has these moments of inertia (allowed: none above the sum of the others)";
            return self.error(vector.span(), &inertia_field, problem);
        }
        Ok(ColliderBody { mass: self.ranged(&mass_field, mass, MASS)?, inertia })
    }
}
