// SPDX-License-Identifier: MIT OR Apache-2.0
//! What components and techniques report about themselves: numbers and sentences.

/// A statistic of a technique.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Stat {
    /// What is counted.
    pub name: &'static str,
    /// Its unit: `bytes`, `faces`, …
    pub unit: &'static str,
    /// Where to read the number.
    pub source: StatSource,
    /// For a number that should be 0: what to do if it is not, because light is missing or wrong
    /// then.
    pub fault: Option<&'static str>,
}

/// Where to read a [`Stat`].
#[derive(Clone, Debug)]
pub enum StatSource {
    /// The CPU knows it.
    Known(u64),
    /// A u32 at this byte of a buffer with `COPY_SRC`.
    Buffer(wgpu::Buffer, u64),
}

impl Stat {
    /// A number that the CPU knows.
    pub fn known(name: &'static str, unit: &'static str, number: u64) -> Self {
        Self { name, unit, source: StatSource::Known(number), fault: None }
    }

    /// A u32 at this byte of a buffer with `COPY_SRC`.
    pub fn counted(name: &'static str, unit: &'static str, buffer: &wgpu::Buffer, at: u64) -> Self {
        Self { name, unit, source: StatSource::Buffer(buffer.clone(), at), fault: None }
    }

    /// Marks the number as one that should be 0, with advice on what to do if it is not.
    pub fn fault(mut self, advice: &'static str) -> Self {
        self.fault = Some(advice);
        self
    }
}

/// A remark about a technique and a scene, in one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Notice {
    /// Whether light will be missing or wrong.
    pub is_warning: bool,
    /// The sentence, without a full stop.
    pub text: String,
}

impl Notice {
    /// A remark that is good to know.
    pub fn note(text: String) -> Self {
        Self { is_warning: false, text }
    }

    /// A warning: what will be wrong, and what to do about it.
    pub fn warning(text: String) -> Self {
        Self { is_warning: true, text }
    }
}
