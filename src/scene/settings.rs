//! Reads the camera settings that the course's renderer writes, and reads with `-c`.
//!
//! A text file of numbers between white space, in lines of fixed meaning that line breaks do not matter to:
//!
//! | numbers | meaning |
//! |---|---|
//! | `hFov vFov ar nClip fClip` | full angles in degrees, width by height, clip distances |
//! | `x y z  x y z` | position, and the point looked at |
//! | `phi theta r minR maxR` | the same in polar coordinates, and limits of zooming |
//! | nine | camera to world, row by row; columns are image right, image up, and the direction **to** the camera |
//! | `screenW screenH screenDist` | size and focal length in pixels |
//! | `focalDistance lensRadius` | thin lens; not in all versions |
//!
//! Of these, the angles, the position and the matrix make the camera; the rest repeats them or does not matter here.

use crate::error::{At, Error, Note, Result};
use crate::scene::camera::Camera;
use crate::scene::viewpoint::tan_half;
use glam::DVec3;
use std::io::Read;
use std::path::Path;

/// What a settings file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The camera.
    pub camera: Camera,
    /// Its position as the file states it.
    pub position: DVec3,
    /// Frame width that the camera was set up for, in pixels.
    pub width: u32,
    /// Frame height that the camera was set up for, in pixels.
    pub height: u32,
    /// What of the file has no effect.
    pub notes: Vec<Note>,
}

/// No settings file is anywhere near this long.
const LONGEST: u64 = 16 * 1024;

/// Reads the settings file at `path`. Errors tell the line.
pub fn settings_file(path: &Path) -> Result<Settings> {
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(|e| Error::io(path, "read", e))?;
    file.take(LONGEST + 1).read_to_end(&mut bytes).map_err(|e| Error::io(path, "read", e))?;
    if bytes.len() as u64 > LONGEST {
        return Err(Error::expected(path, At::File, "too long for camera settings", "about 30 numbers"));
    }
    let text = std::str::from_utf8(&bytes)
        .map_err(|e| Error::expected(path, At::Byte(e.valid_up_to() as u64), "not text", "numbers"))?;
    parse(text, path)
}

/// The numbers of a file, one after the other, each with its line.
struct Numbers<'a> {
    path: &'a Path,
    words: std::iter::Peekable<Box<dyn Iterator<Item = (u64, &'a str)> + 'a>>,
    line: u64,
}

impl<'a> Numbers<'a> {
    fn new(text: &'a str, path: &'a Path) -> Self {
        let words = text.lines().zip(1u64..).flat_map(|(line, n)| line.split_whitespace().map(move |word| (n, word)));
        let words: Box<dyn Iterator<Item = _>> = Box::new(words);
        Numbers { path, words: words.peekable(), line: 1 }
    }

    fn next(&mut self, what: &str) -> Result<f64> {
        let Some((line, word)) = self.words.next() else {
            return Err(Error::expected(self.path, At::Line(self.line), "the file ends too early", what));
        };
        self.line = line;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => {
                let shown: String = word.chars().take(40).collect();
                Err(Error::expected(self.path, At::Line(line), format!("`{shown}` is not a number"), what))
            }
        }
    }

    fn vector(&mut self, what: &str) -> Result<DVec3> {
        Ok(DVec3::new(self.next(what)?, self.next(what)?, self.next(what)?))
    }

    fn skip(&mut self, names: &[&str]) -> Result<()> {
        names.iter().try_for_each(|name| self.next(name).map(drop))
    }

    fn angle(&mut self, what: &str) -> Result<f64> {
        let degrees = self.next(what)?;
        tan_half(degrees).map_err(|e| Error::import(self.path, At::Line(self.line), e))
    }

    fn pixels(&mut self, what: &str) -> Result<u32> {
        let number = self.next(what)?;
        if number >= 1.0 && number <= f64::from(u16::MAX) && number.fract() == 0.0 {
            return Ok(number as u32);
        }
        Err(Error::expected(self.path, At::Line(self.line), format!("`{number}` is no number of pixels"), what))
    }
}

fn parse(text: &str, path: &Path) -> Result<Settings> {
    let mut numbers = Numbers::new(text, path);
    let tan_x = numbers.angle("the horizontal field of view in degrees")?;
    let tan_y = numbers.angle("the vertical field of view in degrees")?;
    numbers.skip(&["the aspect ratio", "the near clip distance", "the far clip distance"])?;
    let position = numbers.vector("the camera's position")?;
    numbers.vector("the point looked at")?;
    numbers.skip(&["phi", "theta", "the distance r", "the least distance", "the largest distance"])?;
    let first_row = numbers.vector("the first row of the camera-to-world matrix")?;
    let matrix_at = At::Line(numbers.line);
    let second_row = numbers.vector("the second row of the camera-to-world matrix")?;
    let third_row = numbers.vector("the third row of the camera-to-world matrix")?;
    let column = |i: usize| DVec3::new(first_row[i], second_row[i], third_row[i]);
    let (right, up, backward) = (column(0), column(1), column(2));
    // The course writes six digits.
    let near = |a: f64, b: f64| (a - b).abs() < 1e-3;
    let unit = [right, up, backward].iter().all(|axis| near(axis.length(), 1.0));
    if !(unit && near(right.dot(up), 0.0) && near(right.cross(up).dot(backward), 1.0)) {
        let what = "the camera-to-world matrix is not a rotation";
        return Err(Error::expected(path, matrix_at, what, "columns right, up and backward, right-handed"));
    }
    let width = numbers.pixels("the frame's width in pixels")?;
    let height = numbers.pixels("the frame's height in pixels")?;
    numbers.skip(&["the focal length in pixels"])?;
    let mut notes = Vec::new();
    if numbers.words.peek().is_some() {
        numbers.next("the lens's focal distance")?;
        if numbers.next("the lens's radius")? != 0.0 {
            notes.push(Note::warning(format!(
                "{}:{}: the lens radius has no effect: cameras are pinholes",
                path.display(),
                numbers.line
            )));
        }
    }
    if let Some(&(line, word)) = numbers.words.peek() {
        let shown: String = word.chars().take(40).collect();
        return Err(Error::expected(path, At::Line(line), format!("`{shown}` is too much"), "the end of the file"));
    }
    let camera = Camera::look(position, -backward, up, tan_x, tan_y).map_err(|e| Error::import(path, At::File, e))?;
    Ok(Settings { camera, position, width, height, notes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// What the course's renderer writes for CBspheres at 480×360.
    const SPHERES: &str = "30.6764 23.2491 1.33333 0.1 100\n0 0.75 4.80234 0 0.75 0 \n1.5708 0 4.80234 0.240117 48.0234\n\
                           1 0 0 0 1 0 0 0 1 \n480 360 875\n4.56 0\n";

    fn read(text: &str) -> Result<Settings> {
        parse(text, Path::new("view.txt"))
    }

    /// The file that the course's renderer would write for `camera`.
    fn written(camera: &Camera, width: u32, height: u32) -> String {
        let degrees = |tan: f32| 2.0 * tan.atan().to_degrees();
        let (p, r, u, b) = (camera.position, camera.right, camera.up, -camera.forward);
        format!(
            "{} {} 1 0.1 100\n{} {} {} 0 0 0\n1 1 1 1 1\n{} {} {} {} {} {} {} {} {}\n{width} {height} 875\n",
            degrees(camera.tan_half_x),
            degrees(camera.tan_half_y),
            p.x,
            p.y,
            p.z,
            r.x,
            u.x,
            b.x,
            r.y,
            u.y,
            b.y,
            r.z,
            u.z,
            b.z
        )
    }

    #[test]
    fn the_course_spheres_view_is_the_course_camera() {
        let settings = read(SPHERES).unwrap();
        assert_eq!((settings.width, settings.height), (480, 360));
        assert_eq!(settings.camera.position, Vec3::new(0.0, 0.75, 4.80234));
        assert_eq!(settings.camera.forward, Vec3::NEG_Z);
        assert_eq!(settings.camera.right, Vec3::X);
        assert!((settings.camera.tan_half_x - 240.0 / 875.0).abs() < 1e-5);
        assert!((settings.camera.tan_half_y - 180.0 / 875.0).abs() < 1e-5);
        assert!(settings.notes.is_empty());
    }

    #[test]
    fn cameras_survive_a_round_trip() {
        let (from, to) = (DVec3::new(3.0, 2.0, -5.0), DVec3::new(-0.3, -0.2, 1.0));
        let camera = Camera::look(from, to, DVec3::Y, 0.4, 0.3).unwrap();
        let back = read(&written(&camera, 640, 480)).unwrap();
        assert_eq!((back.width, back.height), (640, 480));
        let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-5, "{a} {b}");
        near(back.camera.position, camera.position);
        near(back.camera.right, camera.right);
        near(back.camera.up, camera.up);
        near(back.camera.forward, camera.forward);
        assert!((back.camera.tan_half_x - 0.4).abs() < 1e-5 && (back.camera.tan_half_y - 0.3).abs() < 1e-5);
    }

    #[test]
    fn a_thin_lens_is_warned_of() {
        assert!(read(&SPHERES.replace("4.56 0\n", "4.56 0.1\n")).unwrap().notes[0].warning);
    }

    #[test]
    fn hostile_files_are_refused_with_their_line() {
        let cases = [
            ("", ":1: the file ends too early"),
            ("\n\n30 20 1 0.1 bogus", ":3: `bogus` is not a number"),
            (&SPHERES.replace("1.5708", "nan"), ":3: `nan`"),
            (&SPHERES.replace("4.80234 0 0.75", "inf 0 0.75"), ":2: `inf`"),
            (&SPHERES.replace("30.6764", "180"), ":1: a field of view of 180"),
            (&SPHERES.replace("30.6764", "-1"), ":1: a field of view of -1"),
            (&SPHERES.replace("1 0 0 0 1 0 0 0 1", "0 0 0 0 0 0 0 0 0"), ":4: the camera-to-world matrix"),
            (&SPHERES.replace("1 0 0 0 1 0 0 0 1", "-1 0 0 0 1 0 0 0 1"), ":4: the camera-to-world matrix"),
            (&SPHERES.replace("480 360", "480.5 360"), ":5: `480.5`"),
            (&SPHERES.replace("480 360", "-480 360"), ":5: `-480`"),
            (&SPHERES.replace("4.56 0\n", "4.56\n"), ":6: the file ends too early"),
            (&format!("{SPHERES}7 8"), ":7: `7` is too much"),
            (&SPHERES[..60], "the file ends too early"),
        ];
        for (text, message) in cases {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(message), "{error} lacks {message}");
        }
        for cut in 0..SPHERES.find(" 875").unwrap() {
            assert!(read(&SPHERES[..cut]).is_err(), "cut at {cut}");
        }
    }

    #[test]
    fn long_and_binary_files_are_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("view.txt");
        assert!(matches!(settings_file(&path), Err(Error::Io { .. })));
        std::fs::write(&path, b"30 20 \xff\xfe").unwrap();
        assert!(settings_file(&path).unwrap_err().to_string().contains("byte 6: not text"));
        std::fs::write(&path, "1 ".repeat(20_000)).unwrap();
        assert!(settings_file(&path).unwrap_err().to_string().contains("too long"));
        std::fs::write(&path, SPHERES).unwrap();
        assert!(settings_file(&path).is_ok());
    }
}
