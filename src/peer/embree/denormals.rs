//! Embree asks its callers to treat tiny numbers as zero ("flush to zero" and "denormals are zero"); comber never does.

/// While it lives, this thread treats denormal numbers as zero.
pub struct AsZero {
    #[cfg(target_arch = "x86_64")]
    before: u32,
}

impl AsZero {
    /// Begins.
    pub fn new() -> AsZero {
        #[cfg(target_arch = "x86_64")]
        {
            /// Flush to zero (bit 15) and denormals are zero (bit 6).
            const BITS: u32 = 1 << 15 | 1 << 6;
            let before = control();
            set_control(before | BITS);
            AsZero { before }
        }
        #[cfg(not(target_arch = "x86_64"))]
        AsZero {}
    }
}

impl Drop for AsZero {
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        set_control(self.before);
    }
}

/// The control and status register of SSE.
#[cfg(target_arch = "x86_64")]
fn control() -> u32 {
    let mut control = 0u32;
    // SAFETY: stores 32 bits to a variable that is there.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack)) };
    control
}

#[cfg(target_arch = "x86_64")]
fn set_control(control: u32) {
    // SAFETY: loads 32 bits that `control()` gave, or those with two more defined bits set. Between the two calls of
    // this file no Rust code computes with floats whose value anyone keeps: only Embree runs.
    unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack)) };
}
