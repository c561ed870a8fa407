//! OpenEXR pictures of other programs.
//!
//! Channels whose names are the same up to the last dot are a layer. The colour is, in this order:
//!
//! 1. a layer without a name (`R G B`: comber, pbrt-v4, Mitsuba, most others), or one that is called `Combined`
//!    (Blender: `ViewLayer.Combined.R`, `RenderLayer.Combined.R`), `Beauty`, `Color`, `Colour`, `RGB` or `RGBA`, of the
//!    first part that has one;
//! 2. a luminance `Y` without a name;
//! 3. the only layer that there is.
//!
//! Where a part's channels have no layer in their names, the part's name is that of the layer, for choosing one by name.
//! Half floats and integers are widened. Alpha is left out: colours are taken as stored, which in OpenEXR is multiplied by
//! it.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, FlatSamples, Layer, ReadChannels as _, ReadLayers as _, Vec2,
    read as exr_read,
};

use super::Found;
use crate::error::{At, Error, Note, Result};
use crate::film::exr_output::{PROVENANCE, check_claims};

/// Names of layers that hold the colour, in lower case.
const COLOURS: [&str; 6] = ["combined", "beauty", "color", "colour", "rgb", "rgba"];

type Part = Layer<AnyChannels<FlatSamples>>;

/// Decodes a file that starts as an EXR does.
pub fn decode(path: &Path, bytes: &[u8], layer: Option<&str>) -> Result<Found> {
    // The exr crate indexes and asserts by what the file says: a broken file may panic in it. The file's bytes are
    // not changed by the attempt, and everything that the attempt built is dropped.
    let decoded = catch_unwind(AssertUnwindSafe(|| parts(path, bytes, layer)));
    let wrong = |what: String| Error::expected(path, At::File, what, "an OpenEXR picture");
    decoded.unwrap_or_else(|_| Err("the file is damaged (its decoder gave up)".into())).map_err(wrong)
}

/// An error is a sentence.
fn parts(path: &Path, bytes: &[u8], layer: Option<&str>) -> std::result::Result<Found, String> {
    let chunks = exr::block::read(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    check_claims(chunks.headers(), bytes.len())?;
    // One thread: a panic in a worker of the crate's pool would end the process.
    let image = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_chunks(chunks)
        .map_err(|e| e.to_string())?;

    let groups = groups(&image.layer_data);
    let group = match layer {
        Some(name) => named(&image.layer_data, &groups, name)?,
        None => colour(&groups)?.clone(),
    };
    let part = &image.layer_data[group.part];
    let frame = image.attributes.display_window;
    let window = Window::new(part, [frame.position.x(), frame.position.y()], frame.size)?;
    let mut found = Found {
        width: window.size[0],
        height: window.size[1],
        x: window.at[0],
        y: window.at[1],
        full: (frame.size.width(), frame.size.height()),
        colours: window.vectors(part, group.channels)?,
        grey: group.channels[0] == group.channels[1],
        what: group.describe(part),
        ..Found::default()
    };
    if window.cut {
        let note = format!("{}: what its data window holds outside of the frame is left out", path.display());
        found.notes.push(Note::info(note));
    }
    // Others call something else by that name: pbrt-v4 the variance of samples, not of their mean.
    if let Some(variance) =
        groups.iter().find(|g| g.part == group.part && g.name == "Variance" && group.name.is_empty())
    {
        match part.attributes.other.get(PROVENANCE.as_bytes()) {
            Some(provenance) => {
                found.variance = Some(window.vectors(part, variance.channels)?);
                if let AttributeValue::Text(text) = provenance {
                    let said = what_of_errors(&text.to_string());
                    found.notes.extend(said.map(|what| Note::info(format!("{}: {what}", path.display()))));
                }
            }
            None => found.notes.push(Note::info(format!(
                "{}: its Variance is not used, as it is not comber's, and may not be that of the mean",
                path.display()
            ))),
        }
    }
    Ok(found)
}

/// What is to be said of a picture's standard errors. Samples of one sequence avoid each other, so that their spread says too much of the error of
/// their mean; the spread of the rounds of a reference says what it is. What pixels share, tests of many of them count many times.
fn what_of_errors(provenance: &str) -> impl Iterator<Item = &'static str> + use<> {
    let about: serde_json::Value = serde_json::from_str(provenance).unwrap_or_default();
    let options = &about["options"];
    let sampler = options["sampler"].as_str().unwrap_or("independent");
    let is_of_one_sequence = about["reference"].is_null() && options["replicates"] == 1 && sampler != "independent";
    let shares = options["reuse"].as_u64().is_some_and(|pixels| pixels > 1);
    let bounds = "its standard errors are upper bounds, as its samples are points of one sequence; those of --replicates are not";
    let alike = "its pixels share paths (--reuse), so errors of neighbours are alike: tests of many pixels find more than there is";
    [is_of_one_sequence.then_some(bounds), shares.then_some(alike)].into_iter().flatten()
}

/// Three channels, or three times the same.
#[derive(Clone)]
struct Group {
    part: usize,
    /// Of the layer.
    name: String,
    channels: [usize; 3],
    /// The name is in those of the channels.
    in_channels: bool,
}

impl Group {
    fn describe(&self, part: &Part) -> String {
        let list = &part.channel_data.list;
        let kind = match list[self.channels[0]].sample_data {
            FlatSamples::F16(_) => "half floats",
            FlatSamples::F32(_) => "floats",
            FlatSamples::U32(_) => "whole numbers",
        };
        let names: Vec<String> = self.channels.iter().map(|&c| list[c].name.to_string()).collect();
        let names = if names[0] == names[1] { names[0].clone() } else { names.join(" ") };
        format!("OpenEXR, {kind}, {names}")
    }

    /// It is named as colours are.
    fn is_colour(&self) -> bool {
        let last = self.name.rsplit('.').next().unwrap_or_default().to_lowercase();
        !self.in_channels || COLOURS.contains(&last.as_str())
    }
}

/// All layers of three channels R, G and B, or of one channel Y.
fn groups(parts: &[Part]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        let names: Vec<String> = part.channel_data.list.iter().map(|c| c.name.to_string()).collect();
        let of_part = part.attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
        let mut seen: Vec<&str> = Vec::new();
        for name in &names {
            let prefix = name.rsplit_once('.').map_or("", |(prefix, _)| prefix);
            if seen.contains(&prefix) {
                continue;
            }
            seen.push(prefix);
            let find = |end: &str| {
                let whole = if prefix.is_empty() { end.to_owned() } else { format!("{prefix}.{end}") };
                names.iter().position(|name| *name == whole)
            };
            let rgb = |ends: [&str; 3]| match ends.map(find) {
                [Some(r), Some(g), Some(b)] => Some([r, g, b]),
                _ => None,
            };
            // Luminance that comes with differences of colour is no grey picture.
            let grey = || find("Y").filter(|_| find("RY").is_none() && find("X").is_none()).map(|y| [y; 3]);
            let Some(channels) = rgb(["R", "G", "B"]).or_else(|| rgb(["r", "g", "b"])).or_else(grey) else { continue };
            let in_channels = !prefix.is_empty();
            let name = if in_channels { prefix.to_owned() } else { of_part.clone() };
            groups.push(Group { part: index, name, channels, in_channels });
        }
    }
    groups
}

/// The group that holds the colour.
fn colour(groups: &[Group]) -> std::result::Result<&Group, String> {
    let is_rgb = |group: &&Group| group.channels[0] != group.channels[1];
    let by_name = groups.iter().filter(is_rgb).find(|group| group.is_colour());
    let grey = || groups.iter().find(|group| !is_rgb(group) && !group.in_channels);
    match (by_name.or_else(grey), groups) {
        (Some(group), _) | (None, [group]) => Ok(group),
        (None, []) => Err("it has no channels R, G and B, nor Y".into()),
        (None, _) => Err(format!("none of its layers is called a colour ({}); name one with --layer", list(groups))),
    }
}

/// The group of this name, or of this end of a name; or a single channel.
fn named(parts: &[Part], groups: &[Group], name: &str) -> std::result::Result<Group, String> {
    let ends = |group: &&Group| group.name.rsplit('.').next() == Some(name);
    if let Some(g) = groups.iter().find(|group| group.name == name).or_else(|| groups.iter().find(ends)) {
        return Ok(g.clone());
    }
    for (part, layer) in parts.iter().enumerate() {
        if let Some(channel) = layer.channel_data.list.iter().position(|c| c.name.to_string() == name) {
            return Ok(Group { part, name: name.to_owned(), channels: [channel; 3], in_channels: true });
        }
    }
    Err(format!("it has no layer or channel '{}', but {}", name.escape_debug(), list(groups)))
}

/// Names for a message.
fn list(groups: &[Group]) -> String {
    const MOST: usize = 12;
    let name = |group: &Group| if group.name.is_empty() { "R G B".to_owned() } else { group.name.clone() };
    let mut names: Vec<String> = groups.iter().take(MOST).map(name).collect();
    if groups.len() > MOST {
        names.push(format!("{} more", groups.len() - MOST));
    }
    if names.is_empty() { "no layer of colours".into() } else { names.join(", ") }
}

/// The part of a data window that lies within the frame.
struct Window {
    /// Left and top within the frame.
    at: [usize; 2],
    /// Left and top within the data window.
    from: [usize; 2],
    size: [usize; 2],
    /// Something lies outside.
    cut: bool,
}

impl Window {
    fn new(part: &Part, frame: [i32; 2], full: Vec2<usize>) -> std::result::Result<Window, String> {
        let Vec2(left, top) = part.attributes.layer_position;
        let axis = |data: i32, size: usize, frame: i32, full: usize| {
            let start = i64::from(data) - i64::from(frame);
            let (low, high) = (start.max(0), (start + size as i64).min(full as i64));
            let length = usize::try_from(high - low).ok().filter(|&length| length > 0)?;
            Some((low as usize, (low - start) as usize, length, length != size))
        };
        let x = axis(left, part.size.width(), frame[0], full.width());
        let y = axis(top, part.size.height(), frame[1], full.height());
        let (Some(x), Some(y)) = (x, y) else {
            return Err("its data window lies outside of its display window".into());
        };
        Ok(Window { at: [x.0, y.0], from: [x.1, y.1], size: [x.2, y.2], cut: x.3 || y.3 })
    }

    fn vectors(&self, part: &Part, channels: [usize; 3]) -> std::result::Result<Vec<[f32; 3]>, String> {
        let list = &part.channel_data.list;
        let across = part.size.width();
        let pixels = across * part.size.height();
        let mut colours = vec![[0.0; 3]; self.size[0] * self.size[1]];
        for (i, &channel) in channels.iter().enumerate() {
            let AnyChannel { name, sample_data, sampling, .. } = &list[channel];
            if *sampling != Vec2(1, 1) || sample_data.len() != pixels {
                return Err(format!("its channel {name} is subsampled"));
            }
            let values: Vec<f32> = sample_data.values_as_f32().collect();
            for (y, row) in colours.chunks_exact_mut(self.size[0]).enumerate() {
                let start = (self.from[1] + y) * across + self.from[0];
                row.iter_mut().zip(&values[start..]).for_each(|(colour, &value)| colour[i] = value);
            }
        }
        Ok(colours)
    }
}
