//! OpenEXR files of named numbers, a channel each.

use super::atomic_file;
use crate::error::{Error, Result};
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, WritableImage as _};
use std::path::Path;

/// Writes `channels`, each of `width · height` values with the top row first, to `path`, whole or not at all.
///
/// # Errors
/// [`Error::Encode`] if there are no pixels or a channel is of another length; [`Error::Io`] if the file cannot be written.
pub fn write(path: &Path, width: usize, height: usize, channels: &[(&str, &[f32])]) -> Result<()> {
    if width * height == 0 || channels.iter().any(|(_, values)| values.len() != width * height) {
        let what = format!("channels of other lengths than {width} × {height}");
        return Err(Error::Encode { path: path.to_path_buf(), what });
    }
    let channels = channels.iter().map(|(name, values)| AnyChannel::new(*name, FlatSamples::F32(values.to_vec())));
    let channels = AnyChannels::sort(channels.collect());
    let image = Image::from_encoded_channels((width, height), Encoding::FAST_LOSSLESS, channels);
    atomic_file::write(path, |file| {
        image.write().to_buffered(file).map_err(|error| match error {
            exr::error::Error::Io(source) => Error::io(path, "write", source),
            other => Error::Encode { path: path.to_path_buf(), what: other.to_string() },
        })
    })
}
