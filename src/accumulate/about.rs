//! What a picture depends on, as data: renders are added up only if all of it is the same.

use crate::cache::digest::digest;
use crate::options::RenderOptions;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use serde_json::{Value, json};

/// Version of comber, scene and options.
pub fn about(name: &str, scene: &Scene, camera: &Camera, options: &RenderOptions) -> Value {
    let mut options = of_picture(options);
    if let Some(options) = options.as_object_mut() {
        // Layers beside the colours are not added up.
        options.remove("aovs");
    }
    json!({
        "comber": env!("CARGO_PKG_VERSION"),
        "scene": name,
        "contents": format!("{:032x}", contents(scene, camera)),
        "options": options,
    })
}

/// The options but for what cannot change the picture: the tree, threads, wave size, instruction set.
pub fn of_picture(options: &RenderOptions) -> Value {
    let (intersection, precision) = (json!(options.accel.intersection), json!(options.accel.precision));
    let mut options = json!(options);
    if let Some(options) = options.as_object_mut() {
        for speed in ["accel", "threads", "wave", "simd"] {
            options.remove(speed);
        }
        options.insert("intersection".into(), intersection);
        options.insert("precision".into(), precision);
    }
    options
}

/// Of all tables of a scene, and of its camera.
fn contents(scene: &Scene, camera: &Camera) -> u128 {
    let shapes = &scene.shapes;
    let runs: Vec<u32> =
        shapes.geometries.iter().flat_map(|g| [g.first_prim, g.prim_count, g.material, g.light]).collect();
    // Numbers are written so that they read back to the bit.
    let small = format!("{:?} {:?} {camera:?}", scene.materials, scene.lights);
    digest(&[
        bytemuck::cast_slice(&shapes.positions),
        bytemuck::cast_slice(&shapes.normals),
        bytemuck::cast_slice(&shapes.triangles),
        bytemuck::cast_slice(&shapes.spheres),
        bytemuck::cast_slice(&shapes.double),
        bytemuck::cast_slice(&shapes.spheres_double),
        bytemuck::cast_slice(&runs),
        small.as_bytes(),
    ])
}

/// What differs, for a message: `options.max_depth is 3 there and 5 here`.
pub fn difference(there: &Value, here: &Value) -> String {
    let mut found = Vec::new();
    collect(there, here, "", &mut found);
    let more = found.len().saturating_sub(MOST);
    found.truncate(MOST);
    if more > 0 {
        found.push(format!("{more} more differ"));
    }
    found.join(", ")
}

/// Most differences that a message names.
const MOST: usize = 4;

fn collect(there: &Value, here: &Value, name: &str, found: &mut Vec<String>) {
    if there == here {
        return;
    }
    if let (Some(a), Some(b)) = (there.as_object(), here.as_object()) {
        let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
        keys.sort();
        keys.dedup();
        for key in keys {
            let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
            collect(a.get(key).unwrap_or(&Value::Null), b.get(key).unwrap_or(&Value::Null), &name, found);
        }
        return;
    }
    let [there, here] = [there, here].map(|value| {
        let text = value.to_string();
        match text.char_indices().nth(60) {
            Some((end, _)) => format!("{}…", &text[..end]),
            None => text,
        }
    });
    found.push(format!("{name} is {there} there and {here} here"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named() {
        let a = json!({"comber": "1", "options": {"seed": 0, "max_depth": 3}, "gone": 1});
        let b = json!({"comber": "1", "options": {"seed": 0, "max_depth": 5}});
        assert_eq!(difference(&a, &b), "gone is 1 there and null here, options.max_depth is 3 there and 5 here");
        assert_eq!(difference(&a, &a), "");
        let many = |n: i32| (0..9).map(|i| (i.to_string(), json!(n))).collect::<Value>();
        assert!(difference(&many(0), &many(1)).ends_with("5 more differ"));
    }

    #[test]
    fn all_that_is_seen_counts() {
        let scene = Scene::default();
        let camera = Camera::look(glam::DVec3::Z, glam::DVec3::NEG_Z, glam::DVec3::Y, 0.5, 0.5).unwrap();
        let options = RenderOptions::default();
        let one = about("a", &scene, &camera, &options);
        assert_eq!(
            one,
            about("a", &scene, &camera, &RenderOptions { threads: Some(3), wave: Some(9), ..options.clone() })
        );
        let mut dark = scene.clone();
        dark.materials.push(crate::material::Material { albedo: glam::Vec3::ZERO, emission: glam::Vec3::ZERO });
        assert!(difference(&one, &about("a", &dark, &camera, &options)).starts_with("contents is"));
        let moved = camera.at(glam::DVec3::ONE);
        assert_ne!(one, about("a", &scene, &moved, &options));
        assert_ne!(one, about("a", &scene, &camera, &RenderOptions { seed: 1, ..options }));
    }
}
