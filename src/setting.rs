// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings, each described once: validation, command line and widgets follow from the description.

use std::fmt;

/// The description of one setting of a technique.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Setting {
    /// Its name, words joined by hyphens: `points`. On the command line it is `--points`.
    pub name: &'static str,
    /// What it does.
    pub help: &'static str,
    /// Its unit: `cells`, `degrees`; empty if it has none.
    pub unit: &'static str,
    /// Its possible values.
    pub kind: SettingKind,
}

impl Setting {
    /// A setting of this name.
    pub const fn new(
        name: &'static str,
        unit: &'static str,
        kind: SettingKind,
        help: &'static str,
    ) -> Self {
        Self { name, help, unit, kind }
    }

    /// Its possible values, in words.
    pub fn possible(&self) -> String {
        match self.kind {
            SettingKind::Switch => "on or off".into(),
            SettingKind::Integer { min, max, word: None } => format!("{min} to {max}"),
            SettingKind::Integer { min, max, word: Some(word) } => {
                format!("{min} to {max}, or {word}")
            }
            SettingKind::OneOf(numbers) => {
                numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
            }
            SettingKind::Number { min, max, words: [] } => format!("{min} to {max}"),
            SettingKind::Number { min, max, words } => {
                let words: Vec<_> = words.iter().map(|word| word.name).collect();
                format!("{min} to {max}, or {}", words.join(", "))
            }
            SettingKind::Choice(choices) => {
                choices.iter().map(|choice| choice.name).collect::<Vec<_>>().join(", ")
            }
            SettingKind::Size { max } => format!("1 to {max}, or three such numbers"),
        }
    }

    /// Parses a value, in the form in which the command line takes it.
    ///
    /// # Errors
    /// The text is not a value of this setting, or is out of range.
    pub fn parse(&self, text: &str) -> Result<SettingValue, SettingError> {
        let wrong = || SettingError::new(self.name, text.to_owned(), self.possible());
        let value = match self.kind {
            SettingKind::Switch => SettingValue::Switch(match text {
                "on" | "true" => true,
                "off" | "false" => false,
                _ => return Err(wrong()),
            }),
            SettingKind::Integer { word, .. } if word == Some(text) => {
                SettingValue::Word(word.unwrap_or_default())
            }
            SettingKind::Integer { .. } | SettingKind::OneOf(_) => {
                SettingValue::Integer(text.parse().map_err(|_| wrong())?)
            }
            SettingKind::Number { words, .. } => {
                match words.iter().find(|word| word.name == text) {
                    Some(word) => SettingValue::Word(word.name),
                    None => SettingValue::Number(text.parse().map_err(|_| wrong())?),
                }
            }
            SettingKind::Choice(choices) => {
                let found = choices.iter().find(|choice| choice.name == text);
                SettingValue::Word(found.ok_or_else(wrong)?.name)
            }
            SettingKind::Size { .. } => {
                let numbers: Result<Vec<u32>, _> = text.split('x').map(str::parse).collect();
                match numbers.map_err(|_| wrong())?[..] {
                    [n] => SettingValue::Integer(n),
                    [x, y, z] => SettingValue::Size([x, y, z]),
                    _ => return Err(wrong()),
                }
            }
        };
        self.check(&value)?;
        Ok(value)
    }

    /// Fails if the value is not one of this setting's, or is out of range.
    ///
    /// # Errors
    /// [`SettingError`]
    pub fn check(&self, value: &SettingValue) -> Result<(), SettingError> {
        let is_right = match (self.kind, value) {
            (SettingKind::Switch, SettingValue::Switch(_)) => true,
            (SettingKind::Integer { min, max, .. }, SettingValue::Integer(n)) => {
                (min..=max).contains(n)
            }
            (SettingKind::Integer { word, .. }, SettingValue::Word(found)) => word == Some(*found),
            (SettingKind::OneOf(numbers), SettingValue::Integer(n)) => numbers.contains(n),
            (SettingKind::Number { min, max, .. }, SettingValue::Number(x)) => {
                (min..=max).contains(x)
            }
            (
                SettingKind::Number { words: choices, .. } | SettingKind::Choice(choices),
                SettingValue::Word(found),
            ) => choices.iter().any(|choice| choice.name == *found),
            (SettingKind::Size { max }, SettingValue::Integer(n)) => (1..=max).contains(n),
            (SettingKind::Size { max }, SettingValue::Size(size)) => {
                size.iter().all(|n| (1..=max).contains(n))
            }
            _ => false,
        };
        if is_right {
            return Ok(());
        }
        Err(SettingError::new(self.name, value.to_string(), self.possible()))
    }
}

/// The possible values of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SettingKind {
    /// On or off.
    Switch,
    /// A whole number, both ends included; or a word.
    Integer {
        /// The least.
        min: u32,
        /// The greatest.
        max: u32,
        /// What may be said instead of a number.
        word: Option<&'static str>,
    },
    /// One of these whole numbers.
    OneOf(&'static [u32]),
    /// A number, both ends included; or a word.
    Number {
        /// The least.
        min: f32,
        /// The greatest.
        max: f32,
        /// What may be said instead of a number.
        words: &'static [SettingChoice],
    },
    /// One of these.
    Choice(&'static [SettingChoice]),
    /// Cells along the longest axis, or along each of three.
    Size {
        /// The greatest number along an axis.
        max: u32,
    },
}

impl SettingKind {
    /// A whole number, both ends included.
    pub const fn integer(min: u32, max: u32) -> Self {
        Self::Integer { min, max, word: None }
    }

    /// A number, both ends included.
    pub const fn number(min: f32, max: f32) -> Self {
        Self::Number { min, max, words: &[] }
    }
}

/// One of several things that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SettingChoice {
    /// Its name.
    pub name: &'static str,
    /// What it means.
    pub help: &'static str,
}

impl SettingChoice {
    /// A choice of this name.
    pub const fn new(name: &'static str, help: &'static str) -> Self {
        Self { name, help }
    }
}

/// A setting's value.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SettingValue {
    /// Of [`SettingKind::Switch`].
    Switch(bool),
    /// A whole number.
    Integer(u32),
    /// A number.
    Number(f32),
    /// A choice's name, or a word instead of a number.
    Word(&'static str),
    /// Three whole numbers.
    Size([u32; 3]),
}

impl fmt::Display for SettingValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Switch(is_on) => f.write_str(if *is_on { "on" } else { "off" }),
            Self::Integer(n) => n.fmt(f),
            Self::Number(x) => x.fmt(f),
            Self::Word(word) => f.write_str(word),
            Self::Size([x, y, z]) => write!(f, "{x}x{y}x{z}"),
        }
    }
}

/// A value that a setting cannot have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} is {value}; possible values: {possible}")]
#[non_exhaustive]
pub struct SettingError {
    /// Which setting.
    pub name: &'static str,
    /// What was given.
    pub value: String,
    /// What may be given.
    pub possible: String,
}

impl SettingError {
    /// `value` of `name` is wrong.
    pub fn new(name: &'static str, value: impl Into<String>, possible: impl Into<String>) -> Self {
        Self { name, value: value.into(), possible: possible.into() }
    }
}

/// A technique's settings: a struct whose fields can be read and set by the names in a list.
pub trait Settings: Default {
    /// All settings.
    const LIST: &'static [Setting];

    /// The value of one of [`Self::LIST`], by its index there.
    fn get(&self, ix: usize) -> SettingValue;

    /// Sets one of [`Self::LIST`], by its index there, to a value that [`Setting::check`] has passed.
    fn set(&mut self, ix: usize, value: SettingValue);

    /// Sets the setting of this name.
    ///
    /// # Errors
    /// There is no setting of this name, or the value is not one of its possible values.
    fn set_by_name(&mut self, name: &str, text: &str) -> Result<(), SettingError> {
        let Some(ix) = Self::LIST.iter().position(|setting| setting.name == name) else {
            let names: Vec<_> = Self::LIST.iter().map(|setting| setting.name).collect();
            return Err(SettingError::new("setting", name, names.join(", ")));
        };
        let value = Self::LIST[ix].parse(text)?;
        self.set(ix, value);
        Ok(())
    }

    /// Default settings with these names and values, set in the order of the list, because some depend on others before
    /// them.
    ///
    /// # Errors
    /// As [`Self::set_by_name`].
    fn from_texts(given: &[(&str, &str)]) -> Result<Self, SettingError> {
        let mut settings = Self::default();
        let place = |name: &str| Self::LIST.iter().position(|setting| setting.name == name);
        let mut sorted = given.to_vec();
        sorted.sort_by_key(|(name, _)| place(name));
        for (name, value) in sorted {
            settings.set_by_name(name, value)?;
        }
        Ok(settings)
    }

    /// Fails if a setting is out of range.
    ///
    /// # Errors
    /// The [`SettingError`] of the first one that is.
    fn check(&self) -> Result<(), SettingError> {
        Self::LIST.iter().enumerate().try_for_each(|(ix, setting)| setting.check(&self.get(ix)))
    }

    /// All settings with their values.
    fn described(&self) -> Vec<(Setting, SettingValue)> {
        (0..).zip(Self::LIST).map(|(ix, &setting)| (setting, self.get(ix))).collect()
    }
}
