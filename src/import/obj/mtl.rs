//! Material libraries: colours and emission by name.

use crate::error::{At, Error, Note, Result};
use crate::import::lines::{Cursor, Fault, Lines, Text, shown};
use crate::import::{bytes, default_material};
use crate::scene::description::{MaterialDescription, Surface};
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// More files than any scene has: a hostile one could name millions.
const MOST: usize = 256;

/// All materials of all libraries.
#[derive(Default)]
pub struct Libraries {
    materials: HashMap<String, Material>,
    seen: HashSet<PathBuf>,
}

struct Material {
    description: MaterialDescription,
    /// Where its diffuse texture is named.
    map: Option<String>,
}

impl Libraries {
    /// The material of this name.
    pub fn find(&self, name: &str) -> Option<&MaterialDescription> {
        self.materials.get(name).map(|material| &material.description)
    }

    /// Where the material names a diffuse texture, if it does.
    pub fn map(&self, name: &str) -> Option<&str> {
        self.materials.get(name)?.map.as_deref()
    }

    /// Reads the files of one `mtllib` line, which `at` is the place of.
    pub fn load(&mut self, obj: &Path, at: impl Fn() -> At, names: &[u8], notes: &mut Vec<Note>) -> Result<()> {
        let names = String::from_utf8_lossy(names);
        let whole = beside(obj, &names);
        // The line may name several files, or one with spaces in its name.
        let paths = if whole.is_file() || !names.contains(char::is_whitespace) {
            vec![whole]
        } else {
            names.split_whitespace().map(|name| beside(obj, name)).collect()
        };
        for path in paths {
            if self.seen.contains(&path) {
                continue;
            }
            if self.seen.len() == MOST {
                let what = format!("more than {MOST} material libraries are named");
                return Err(Error::expected(obj, at(), what, "fewer"));
            }
            if path.is_file() {
                self.read(&path)?;
            } else {
                let text = format!("{}{}: material library {} is missing", obj.display(), at(), shown_path(&path));
                notes.push(Note::warning(text));
            }
            self.seen.insert(path);
        }
        Ok(())
    }

    fn read(&mut self, path: &Path) -> Result<()> {
        let bytes = bytes::read(path)?;
        let text = Text::new(&bytes, true);
        let mut cursor = text.cursor(0..bytes.len());
        let mut lines = Lines::new(text);
        let mut current = None;
        while !cursor.finished() {
            let offset = cursor.offset();
            match cursor.token() {
                Some([b'#', ..]) => {
                    cursor.skip_comment();
                    continue;
                }
                Some(b"newmtl") => {
                    let name = String::from_utf8_lossy(cursor.rest()).into_owned();
                    let at = lines.at(offset);
                    let description = MaterialDescription { name: name.clone(), at, ..default_material() };
                    self.materials.insert(name.clone(), Material { description, map: None });
                    current = Some(name);
                }
                Some(word) => {
                    let material = current.as_ref().and_then(|name| self.materials.get_mut(name));
                    let done = match material {
                        Some(material) if word == b"map_Kd" => {
                            material.map = Some(format!("{}{}", path.display(), lines.at(offset)));
                            Ok(())
                        }
                        Some(material) => colours(word, &mut cursor, &mut material.description),
                        None if matches!(word, b"Kd" | b"Ke" | b"map_Kd") => {
                            let what = format!("{} belongs to no material", shown(word));
                            Err(cursor.fault(what, "a line “newmtl” before it"))
                        }
                        None => Ok(()),
                    };
                    done.map_err(|fault| text.error(path, fault))?;
                }
                None => {}
            }
            cursor.next_line();
        }
        Ok(())
    }
}

fn colours(word: &[u8], cursor: &mut Cursor, material: &mut MaterialDescription) -> std::result::Result<(), Fault> {
    match word {
        b"Kd" => material.surface = Surface::Diffuse { albedo: colour(cursor)? },
        b"Ke" => material.emission = colour(cursor)?,
        _ => {}
    }
    Ok(())
}

/// Three channels, or one for all three.
fn colour(cursor: &mut Cursor) -> std::result::Result<Vec3, Fault> {
    let red = cursor.f32("red")?;
    let colour =
        if cursor.find_token() { Vec3::new(red, cursor.f32("green")?, cursor.f32("blue")?) } else { Vec3::splat(red) };
    if colour.is_finite() && colour.min_element() >= 0.0 {
        return Ok(colour);
    }
    let Vec3 { x, y, z } = colour;
    Err(cursor.fault(format!("the colour is ({x}, {y}, {z})"), "finite channels, 0 or more"))
}

/// A library's path: relative to the folder of the OBJ file, whichever slashes it was written with. Of an absolute
/// one, from the machine that exported it, only the name is of use.
fn beside(obj: &Path, name: &str) -> PathBuf {
    let name = name.replace('\\', "/");
    let drive = name.as_bytes().get(1) == Some(&b':');
    let relative = if drive || name.starts_with('/') { name.rsplit('/').next().unwrap_or_default() } else { &name };
    obj.with_file_name("").join(relative).components().collect()
}

/// A path for a message, which a hostile file could make any length.
fn shown_path(path: &Path) -> String {
    let text = path.display().to_string();
    match text.char_indices().nth(200) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
