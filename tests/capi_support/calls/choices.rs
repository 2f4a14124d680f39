//! Bytes read as choices: numbers, counts, indices and pointers, ordinary and absurd.

use std::ptr;

/// Bytes that are read as choices; when they end, everything is 0.
#[derive(Debug)]
pub struct Choices<'a> {
    pub(super) bytes: &'a [u8],
}

impl<'a> Choices<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    pub(super) fn byte(&mut self) -> u8 {
        match self.bytes.split_first() {
            Some((first, rest)) => {
                self.bytes = rest;
                *first
            }
            None => 0,
        }
    }

    /// A number below `count`.
    pub(super) fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count.max(1)
    }

    /// True once in `n` times.
    pub(super) fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == n - 1
    }

    pub(super) fn number(&mut self) -> f64 {
        let ordinary = (f64::from(self.byte()) - 128.0) / 256.0;
        match self.below(24) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => f64::NEG_INFINITY,
            3 => 1e300,
            4 => -1e300,
            5 => 1e-300,
            6 => 0.0,
            7 => -0.0,
            8 => ordinary * 1e6,
            _ => ordinary,
        }
    }

    /// A number that a call of this kind would take, mostly.
    pub(super) fn near(&mut self, usual: f64) -> f64 {
        if self.once_in(6) {
            self.number()
        } else {
            usual
        }
    }

    pub(super) fn index(&mut self) -> u32 {
        match self.below(8) {
            0 => u32::MAX,
            1 => 1 << 31,
            2 => 1000,
            _ => self.below(6) as u32,
        }
    }

    /// A count that is `right`, less, or more than there can be; never a little more, which would
    /// be the caller's fault.
    pub(super) fn count(&mut self, right: usize) -> usize {
        match self.below(10) {
            0 => usize::MAX,
            1 => 1 << 40,
            2 => isize::MAX as usize,
            3 => self.below(right + 1),
            4 => 0,
            _ => right,
        }
    }

    pub(super) fn numbers(&mut self, count: usize) -> Vec<f64> {
        let wild = self.once_in(4);
        (0..count)
            .map(|_| {
                if wild {
                    self.number()
                } else {
                    (f64::from(self.byte()) - 128.0) / 512.0
                }
            })
            .collect()
    }

    /// The pointer, or NULL now and then.
    pub(super) fn maybe<T>(&mut self, pointer: *const T) -> *const T {
        if self.once_in(16) {
            ptr::null()
        } else {
            pointer
        }
    }

    pub(super) fn maybe_mut<T>(&mut self, pointer: *mut T) -> *mut T {
        if self.once_in(16) {
            ptr::null_mut()
        } else {
            pointer
        }
    }
}

/// A struct's size: right, shorter, or one that cannot be.
pub(super) fn size(choices: &mut Choices<'_>, right: usize) -> usize {
    match choices.below(16) {
        0 => 0,
        1 => usize::MAX,
        2 => 8 + choices.below(right - 8),
        3 => 8 * (1 + choices.below(right / 8)),
        _ => right,
    }
}
