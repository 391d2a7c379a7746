//! Warnings about bends that the substeps do not reach, and about missing ones.

use sim_scene::constraints::bends::Bend;
use sim_scene::model::Model;
use sim_scene::scene::{Generator, PASSES_MAX, Scene, Shape, SheetBending};

use super::rounded::three_digits;

/// The solver bends as if alpha were greater by k h^2 / m, where m is the mass of a particle: each group of
/// bends undoes a part of the corrections before it. In the middle of a long strip k is 3 (the mean of 6, 3
/// and 0 in its three groups); a cantilever of eight cells has 1.8. Further passes reduce it faster than with
/// their square.
///
/// It is half of the sum of c^2 over the particles, for every kind of bend: in a surface that is bent evenly,
/// the multipliers of all bends are equal, and their forces cancel. So what the bends after one of them move
/// is, on average, half of what it has moved itself.
const FACTOR: f64 = 3.0;
/// Share of the rigidity by which the reached one may be less.
const TOLERANCE: f64 = 0.1;

/// Bends of one place in the scene: the stiffest of them.
struct Place {
    /// Path of the field.
    field: String,
    unit: &'static str,
    rigidity: f64,
    /// m alpha in s^2: the square of the time scale of the bend.
    square_time: f64,
}

/// Warns of rigidities that the substeps reach by less than 90 %: one sentence for each generator, and one
/// for the explicit bend that is farthest from its rigidity.
pub(super) fn unreached(scene: &Scene, model: &Model) -> Vec<String> {
    let mut rest = &model.bends[scene.bends.len()..];
    let generated = scene.generators.iter().enumerate().filter_map(|(index, one)| {
        #[allow(clippy::cast_possible_truncation, reason = "not more than the bends of the model")]
        let (bends, others) = rest.split_at(one.shape.bend_count() as usize);
        rest = others;
        of_generator(index, one, &Generated { bends, model })
    });
    let explicit = (0..scene.bends.len()).map(|index| of_bend(index, model));
    let explicit = explicit.min_by(|a, b| a.square_time.total_cmp(&b.square_time));
    generated.chain(explicit).filter_map(|place| sentence(&place, scene)).collect()
}

/// The bends of a generator.
struct Generated<'a> {
    bends: &'a [Bend],
    model: &'a Model,
}

/// Warns of edges of meshes that have no hinge.
pub(super) fn missing_hinges(scene: &Scene) -> Vec<String> {
    let sentence = |(index, generator): (usize, &Generator)| {
        let Shape::Obj(obj) = &generator.shape else { return None };
        obj.bending?;
        let count = obj.missing_hinge_count();
        let edges = if count == 1 { "edge has no hinge" } else { "edges have no hinges" };
        (count > 0).then(|| {
            format!(
                "generate[{index}].bending: {count} {edges}, because an adjacent triangle has no height: merge \
                 its corners, or divide its longest side"
            )
        })
    };
    scene.generators.iter().enumerate().filter_map(sentence).collect()
}

fn of_generator(index: usize, generator: &Generator, generated: &Generated<'_>) -> Option<Place> {
    let field = format!("generate[{index}].bending");
    let (rigidity, geometry, unit) = match &generator.shape {
        Shape::Cloth(cloth) | Shape::Mesh(cloth) => {
            let SheetBending { bending, .. } = cloth.bending?;
            let [warp, weft] = bending.threads().map(f64::from);
            let [of_warp, of_weft] = cloth.bend_geometries();
            let is_warp_stiffer = warp * of_weft >= weft * of_warp;
            let (rigidity, geometry) =
                if is_warp_stiffer { (warp, of_warp) } else { (weft, of_weft) };
            (rigidity, geometry, "N m")
        }
        Shape::Rope(rope) => (f64::from(rope.bending?), rope.spacing().powi(3), "N m²"),
        Shape::Obj(obj) => {
            let rigidity = f64::from(obj.bending?.bending);
            let square_time = of_hinges(generated) / rigidity;
            return Some(Place { field, unit: "N m", rigidity, square_time });
        }
        Shape::Web(_) | Shape::Bridge(_) | Shape::Ragdoll(_) => return None,
    };
    let square_time = f64::from(generator.mass) * geometry / rigidity;
    Some(Place { field, unit, rigidity, square_time })
}

/// m alpha B of hinges, where m is the mass with which particles in lines would be as soft.
fn of_hinges(Generated { bends, model }: &Generated<'_>) -> f64 {
    let inverse_mass = |index: u32| 1.0 / f64::from(model.particles[index as usize].mass);
    let weight = |bend: &Bend| {
        let terms = bend.particles.iter().zip(bend.coefficients);
        terms.map(|(index, c)| inverse_mass(*index) * f64::from(c * c)).sum::<f64>()
    };
    let geometry: f64 = bends.iter().map(|bend| f64::from(bend.geometry)).sum();
    let weights: f64 = bends.iter().map(weight).sum();
    FACTOR * geometry / (weights / 2.0)
}

/// The mass is that with which all particles would weigh as much: sum of c^2 / sum of c^2 / m.
fn of_bend(index: usize, model: &Model) -> Place {
    let Bend { particles, coefficients, geometry, rigidity, .. } = model.bends[index];
    let squares = coefficients.map(|c| f64::from(c * c));
    let weights = particles.map(|one| 1.0 / f64::from(model.particles[one as usize].mass));
    let weight: f64 = squares.iter().zip(weights).map(|(square, weight)| square * weight).sum();
    let mass = squares.iter().sum::<f64>() / weight;
    let rigidity = f64::from(rigidity);
    let unit = if coefficients[3] == 0.0 { "N m²" } else { "N m" };
    let square_time = mass * f64::from(geometry) / rigidity;
    Place { field: format!("bend[{index}].rigidity"), unit, rigidity, square_time }
}

fn sentence(place: &Place, scene: &Scene) -> Option<String> {
    let Place { field, unit, rigidity, square_time } = place;
    let passes = f64::from(scene.solver.iterations);
    let (rate, substeps) = (f64::from(scene.solver.rate_hz), f64::from(scene.solver.substeps));
    let softening = |substeps: f64| FACTOR / ((rate * substeps * passes).powi(2) * square_time);
    let reached = rigidity / (1.0 + softening(substeps));
    // NaN: a bend without length and without rigidity.
    if reached.is_nan() || reached >= (1.0 - TOLERANCE) * rigidity {
        return None;
    }
    let sufficient = (softening(1.0) * (1.0 - TOLERANCE) / TOLERANCE).sqrt().ceil();
    let remedy = if sufficient <= f64::from(PASSES_MAX) {
        format!("{sufficient} substeps suffice")
    } else {
        "use a greater spacing, or heavier particles".to_owned()
    };
    Some(format!(
        "{field}: {substeps} substeps at {rate} Hz reach a rigidity of {} {unit} instead of {}: {remedy}",
        three_digits(reached),
        three_digits(*rigidity)
    ))
}
