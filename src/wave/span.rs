//! What a wave is asked to do: runs of samples of one pixel each.

/// Samples of one pixel; they occupy successive slots of the wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// Column of the frame.
    pub x: u32,
    /// Row of the frame.
    pub y: u32,
    /// `y · width + x`: seeds the random numbers.
    pub pixel: u32,
    /// First sample.
    pub first: u32,
    /// From one sample's number to the next: 2 where only every other sample is still wanted.
    pub stride: u32,
    /// How many samples.
    pub count: u32,
    /// Which of the tiles at hand the pixel belongs to.
    pub tile: u32,
    /// Which pixel of that tile.
    pub local: u32,
}

impl Span {
    /// Takes the first `count` samples off.
    pub fn split_off_front(&mut self, count: u32) -> Span {
        let front = Span { count, ..*self };
        self.first += count * self.stride;
        self.count -= count;
        front
    }
}
