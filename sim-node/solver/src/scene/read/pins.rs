//! Expressions that pin vertices of a mesh: comparisons of coordinates, or a group.

use crate::scene::mesh::Mesh;

/// Returns the vertices that match an expression: `y > 1.9`, `x <= 0 and z < 0.5`, or `group NAME`.
pub(super) fn matching_vertices(expression: &str, mesh: &Mesh) -> Result<Vec<u32>, String> {
    if let Some(name) = expression.trim().strip_prefix("group ") {
        return mesh.groups.get(name.trim()).cloned().ok_or_else(|| {
            let names: Vec<_> = mesh.groups.keys().map(String::as_str).collect();
            format!("the mesh has no group '{}' (allowed: {})", name.trim(), names.join(", "))
        });
    }
    let terms: Result<Vec<_>, _> = expression.split(" and ").map(Comparison::parse).collect();
    let terms = terms?;
    let all = (0_u32..).zip(&mesh.vertices);
    let pinned = all.filter(|(_, vertex)| terms.iter().all(|term| term.matches(vertex)));
    Ok(pinned.map(|(index, _)| index).collect())
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
    fn parse(term: &str) -> Result<Self, String> {
        let problem = || {
            format!(
                "'{}' is not an expression for vertices (allowed: none, a list of indices, 'y > 1.9', \
                 'x < 0 and y >= 1', 'group NAME')",
                term.trim()
            )
        };
        let (operator, (axis, number)) = OPERATORS
            .iter()
            .find_map(|operator| Some((operator, term.split_once(operator)?)))
            .ok_or_else(problem)?;
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis.trim());
        let number: f32 = number.trim().parse().map_err(|_| problem())?;
        Ok(Self { axis: axis.ok_or_else(problem)?, operator, number })
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
