//! The scenes in the repository are those that their generator writes.

#[allow(dead_code)] // Its `main` writes the files; here they are compared.
#[path = "../examples/make_scenes.rs"]
mod make_scenes;

use std::path::Path;

#[test]
fn committed_scenes_are_what_the_generator_writes() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, text) in make_scenes::files() {
        let committed = std::fs::read_to_string(directory.join(name)).unwrap();
        assert!(committed == text, "{name} differs: run `cargo run --example make_scenes`");
    }
}

#[test]
fn they_stay_small() {
    let bytes: usize = make_scenes::files().iter().map(|(_, text)| text.len()).sum();
    assert!(bytes < 1_500_000, "{bytes}");
}
