//! Decisions and numbers from the bytes of an input; zeros after its end.

/// The rest of an input.
pub struct Input<'a>(pub &'a [u8]);

impl Input<'_> {
    /// Takes a byte.
    pub fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    /// Takes a whole number.
    pub fn short(&mut self) -> i16 {
        i16::from_le_bytes(self.take())
    }

    /// Takes any number.
    pub fn number(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.0.split_at(self.0.len().min(N));
        self.0 = rest;
        std::array::from_fn(|i| taken.get(i).copied().unwrap_or_default())
    }
}
