//! The ways in which Embree can be asked for the hits of many rays.

use super::ffi::property;
use super::library::Device;
use serde::Serialize;
use std::fmt;

/// Which calls trace the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Calls {
    /// `rtcIntersect1`, `rtcOccluded1`.
    Single,
    /// `rtcIntersect4` and so on: 4, 8 or 16 rays a call.
    Packets(usize),
    /// `rtcIntersect1M`, `rtcOccluded1M`: a stream of single rays. Version 3 only.
    Stream,
    /// `rtcIntersectNp`, `rtcOccludedNp`: a stream of rays in columns. Version 3 only.
    StreamColumns,
}

/// A way to ask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Mode {
    /// The calls.
    pub calls: Calls,
    /// The flag that says that rays go the same way.
    pub coherent: bool,
    /// Rays that lie ready at a time, and for streams: rays a call. `None`: all of them.
    pub batch: Option<usize>,
}

/// Rays that lie ready at a time for single rays and packets: few enough that their records stay in the second-level cache
/// between being written and being traced.
const READY: usize = 1024;

impl Mode {
    /// All that `device` can do, with streams of `wave` rays and of all rays.
    pub fn all(device: &Device, wave: usize) -> Vec<Mode> {
        let mut calls = vec![(Calls::Single, Some(READY))];
        calls.extend([4, 8].map(|width| (Calls::Packets(width), Some(READY))));
        if device.property(property::NATIVE_RAY16) != 0 {
            calls.push((Calls::Packets(16), Some(READY)));
        }
        if device.api().closest.streams.is_some() && device.property(property::RAY_STREAM) != 0 {
            let streams = [Calls::Stream, Calls::StreamColumns];
            calls.extend(streams.into_iter().flat_map(|stream| [(stream, Some(wave)), (stream, None)]));
        }
        let both = |(calls, batch)| [false, true].map(|coherent| Mode { calls, coherent, batch });
        // A single ray is coherent with nothing: the flag changes nothing there.
        calls.into_iter().flat_map(both).filter(|mode| mode.calls != Calls::Single || !mode.coherent).collect()
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.calls {
            Calls::Single => return f.write_str("single"),
            Calls::Packets(width) => write!(f, "packets of {width}")?,
            Calls::Stream => f.write_str("stream")?,
            Calls::StreamColumns => f.write_str("stream of columns")?,
        }
        if !matches!(self.calls, Calls::Packets(_)) {
            match self.batch {
                Some(rays) => write!(f, " of {rays}")?,
                None => f.write_str(" of all")?,
            }
        }
        f.write_str(if self.coherent { ", coherent" } else { ", incoherent" })
    }
}
