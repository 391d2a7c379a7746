//! Which vertices of a mesh are pinned: comparisons of coordinates, or a group.

use super::obj::Mesh;

/// The vertices that an expression names: `y > 1.9`, `x <= 0 and z < 0.5`, or `group NAME`.
pub(super) fn vertices(expression: &str, mesh: &Mesh) -> Result<Vec<u32>, String> {
    if let Some(name) = expression.trim().strip_prefix("group ") {
        return mesh.groups.get(name.trim()).cloned().ok_or_else(|| {
            let names: Vec<_> = mesh.groups.keys().map(String::as_str).collect();
            format!("there is no group '{}' (allowed: {})", name.trim(), names.join(", "))
        });
    }
    let terms: Result<Vec<_>, _> = expression.split(" and ").map(Comparison::read).collect();
    let terms = terms?;
    let all = (0_u32..).zip(&mesh.vertices);
    let pinned = all.filter(|(_, vertex)| terms.iter().all(|term| term.holds(vertex)));
    Ok(pinned.map(|(index, _)| index).collect())
}

/// One coordinate against a number.
struct Comparison {
    axis: usize,
    operator: &'static str,
    number: f32,
}

/// Longer ones first: `<` also begins `<=`.
const OPERATORS: [&str; 4] = ["<=", ">=", "<", ">"];

impl Comparison {
    fn read(term: &str) -> Result<Self, String> {
        let problem = || {
            format!(
                "'{}' is no choice of vertices (allowed: none, a list of indices, 'y > 1.9', \
                 'x < 0 and y >= 1', 'group NAME')",
                term.trim()
            )
        };
        let found =
            OPERATORS.iter().find_map(|operator| Some((operator, term.split_once(operator)?)));
        let (operator, (axis, number)) = found.ok_or_else(problem)?;
        let axis = ["x", "y", "z"].iter().position(|name| *name == axis.trim());
        let number: f32 = number.trim().parse().map_err(|_| problem())?;
        Ok(Self { axis: axis.ok_or_else(problem)?, operator, number })
    }

    fn holds(&self, vertex: &[f32; 3]) -> bool {
        let value = vertex[self.axis];
        match self.operator {
            "<=" => value <= self.number,
            ">=" => value >= self.number,
            "<" => value < self.number,
            _ => value > self.number,
        }
    }
}
