//! A measure of tangling, for any cloth. The comparison with another engine uses it, too.

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns true if a segment pierces a triangle (Moeller, Trumbore 1997).
fn pierces([from, to]: [[f64; 3]; 2], [u, v, w]: [[f64; 3]; 3]) -> bool {
    let (along, first, second) = (minus(to, from), minus(v, u), minus(w, u));
    let normal = cross(along, second);
    let scale = dot(first, normal);
    let start = minus(from, u);
    let (b, c) = (dot(start, normal) / scale, dot(along, cross(start, first)) / scale);
    let at = dot(second, cross(start, first)) / scale;
    b >= 0.0 && c >= 0.0 && b + c <= 1.0 && at > 0.0 && at < 1.0
}

/// Returns the number of edges that pierce a triangle without sharing a vertex with it.
pub(crate) fn count(at: &[[f64; 3]], edges: &[[u32; 2]], triangles: &[[u32; 3]]) -> usize {
    let corners = |indices: [u32; 3]| indices.map(|index| at[index as usize]);
    let bounds = |points: &[[f64; 3]]| {
        let side = |pick: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).reduce(pick).unwrap())
        };
        [side(f64::min), side(f64::max)]
    };
    let triangles: Vec<_> = triangles.iter().map(|one| (*one, bounds(&corners(*one)))).collect();
    let pierced = edges.iter().map(|edge| {
        let ends = edge.map(|end| at[end as usize]);
        let [min, max] = bounds(&ends);
        let near = triangles.iter().filter(|(indices, [low, high])| {
            (0..3).all(|axis| low[axis] <= max[axis] && min[axis] <= high[axis])
                && !edge.iter().any(|end| indices.contains(end))
        });
        near.filter(|(indices, _)| pierces(ends, corners(*indices))).count()
    });
    pierced.sum()
}
