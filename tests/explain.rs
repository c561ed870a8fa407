//! A sample told vertex by vertex is the sample that is rendered.

use comber::bvh::Accel;
use comber::explain::{Event, Story};
use comber::options::{Direct, Integrator, RenderOptions, Roulette};
use comber::plan::Plan;
use comber::sampling::v3::V3;
use comber::scene::stage::{Stage, UpAxis, place};
use comber::scene::{Scene, SceneOptions, procedural};
use comber::{drive, observer::Unobserved};
use std::process::Command;

/// Waves render one sample a pixel: its picture is what the stories of all pixels say, to the bit.
#[test]
fn stories_are_of_the_samples_that_waves_render() {
    let staged = place(procedural::generate("proc:torus,tris=2k").unwrap(), Stage::Cornell, UpAxis::Y).unwrap();
    let scene = Scene::build(staged.description, SceneOptions::default()).unwrap();
    let base = RenderOptions { width: 24, height: 18, samples: 1, ..RenderOptions::default() };
    let accel = Accel::build(&scene.shapes, &base.accel).unwrap();
    for direct in [Direct::Mis, Direct::Light, Direct::Bsdf, Direct::Hemisphere] {
        for (integrator, roulette) in [
            (Integrator::Path, Roulette::Fixed(0.7)),
            (Integrator::Path, Roulette::EFFICIENCY),
            (Integrator::IndirectOnly, Roulette::Off),
            (Integrator::Normals, Roulette::Off),
        ] {
            let options = RenderOptions { direct, integrator, roulette, ..base.clone() };
            let plan = Plan::new(&scene, &accel, &options).unwrap();
            let picture = drive::render(&scene, &accel, &staged.camera, &plan, &Unobserved).unwrap().picture;
            let mut rays = 0;
            for (at, pixel) in picture.beauty.iter().enumerate() {
                let (x, y) = (at as u32 % 24, at as u32 / 24);
                let story = Story::of((&scene, &accel, &staged.camera), &options, x, y, 0);
                assert_eq!(story.sample.radiance.map(f32::to_bits), pixel.map(f32::to_bits), "{x}, {y}");
                rays += story.events.iter().filter(|event| matches!(event, Event::Ray { .. })).count();
                // Its steps add up to it, in the order in which they are told.
                if integrator != Integrator::Normals {
                    let zero = V3::new(0.0f32, 0.0, 0.0);
                    let sum = story.events.iter().filter_map(Event::adds).fold(zero, |sum, value| sum + value);
                    assert_eq!([sum.x, sum.y, sum.z], story.sample.radiance);
                }
                let text = story.text(&scene);
                assert!(text.contains("radiance") && !text.contains("not finite"), "{text}");
            }
            assert!(rays >= 24 * 18);
        }
    }
}

#[test]
fn the_command_tells_it() {
    let run = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_comber"));
        command.args(line.split_whitespace()).output().unwrap()
    };
    let scene = "proc:cubes,tris=200 -r 32 24";
    let output = run(&format!("render {scene} --explain --pixel 16,12 --sample 3"));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    for part in ["pixel 16, 12, sample 3", "bounce 0", "hits", "light", "radiance"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    for line in [
        format!("render {scene} --explain"),
        format!("render {scene} --pixel 1,1"),
        format!("render {scene} --explain --pixel 32,0"),
        format!("render {scene} --explain --pixel 1"),
        format!("info {scene} --explain --pixel 1,1"),
        format!("profile {scene} --explain --pixel 1,1"),
    ] {
        assert_eq!(run(&line).status.code(), Some(2), "{line}");
    }
}
