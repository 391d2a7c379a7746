//! Expressions that pin vertices of a mesh: comparisons of coordinates, or a group.

use super::Mesh;

/// Returns the vertices that match an expression: `y > 1.9`, `x <= 0 and z < 0.5`, or `group NAME`.
pub(crate) fn matching_vertices(expression: &str, mesh: &Mesh) -> Result<Vec<u32>, String> {
    if let Some(name) = expression.trim().strip_prefix("group ") {
        return mesh.groups.get(name.trim()).cloned().ok_or_else(|| {
            let names: Vec<_> = mesh.groups.keys().map(String::as_str).collect();
            let cure = match names.join(", ").as_str() {
                "" => "it has no groups".to_owned(),
                names => format!("allowed: {names}"),
            };
            format!("the mesh has no group '{}' ({cure})", name.trim())
        });
    }
    let terms = parse_terms(expression)
        .map_err(|term| unknown_expression(term, "none, a list of indices"))?;
    let all = (0_u32..).zip(&mesh.vertices);
    let pinned = all.filter(|(_, vertex)| terms.iter().all(|term| term.matches(vertex)));
    Ok(pinned.map(|(index, _)| index).collect())
}

/// Returns the coordinates of a mesh on each axis, because its pins are compared with them.
pub(crate) fn extent(mesh: &Mesh) -> String {
    let range = |axis: usize| {
        let mut values: Vec<_> = mesh.vertices.iter().map(|vertex| vertex[axis]).collect();
        values.sort_unstable_by(f32::total_cmp);
        let (Some(least), Some(most)) = (values.first(), values.last()) else {
            return String::new();
        };
        format!("{} {least} to {most}", ["x", "y", "z"][axis])
    };
    [0, 1, 2].map(range).join(", ")
}

/// Checks the form of the choice of pinned vertices that a command line gives for a mesh: `none` or
/// an expression. The names of groups are left to the mesh.
///
/// # Errors
/// The text is neither.
pub fn check_pin_expression(text: &str) -> Result<(), String> {
    if text == "none" || text.trim().starts_with("group ") {
        return Ok(());
    }
    parse_terms(text).map(|_| ()).map_err(|term| unknown_expression(term, "none"))
}

/// Parses the comparisons of an expression. The error is the term that is none.
fn parse_terms(expression: &str) -> Result<Vec<Comparison>, &str> {
    expression.split(" and ").map(|term| Comparison::parse(term).ok_or(term.trim())).collect()
}

fn unknown_expression(term: &str, others: &str) -> String {
    format!(
        "'{term}' is not an expression for vertices (allowed: {others}, 'y > 1.9', \
         'x < 0 and y >= 1', 'group NAME')"
    )
}

/// A comparison of a coordinate with a number.
struct Comparison {
    axis: usize,
    operator: &'static str,
    number: f32,
}

/// The longer operators come first, because `<=` also contains `<`.
const OPERATORS: [&str; 4] = ["<=", ">=", "<", ">"];

impl Comparison {
    fn parse(term: &str) -> Option<Self> {
        let (operator, (axis, number)) =
            OPERATORS.iter().find_map(|operator| Some((operator, term.split_once(operator)?)))?;
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis.trim())?;
        Some(Self { axis, operator, number: number.trim().parse().ok()? })
    }

    fn matches(&self, vertex: &[f32; 3]) -> bool {
        let value = vertex[self.axis];
        match self.operator {
            "<=" => value <= self.number,
            ">=" => value >= self.number,
            "<" => value < self.number,
            _ => value > self.number,
        }
    }
}
