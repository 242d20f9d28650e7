// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flags generated from the techniques' lists of settings.

use clap::builder::StyledStr;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use lucerna::techniques::{Setting, SettingKind, SettingValue, TECHNIQUES, TechniqueEntry};

/// Settings that were given, of any technique.
///
/// `OF_BAKES`: only those that matter when light is baked.
#[derive(Clone, Debug, Default)]
pub struct SettingArguments<const OF_BAKES: bool = false> {
    given: Vec<(&'static str, String)>,
}

/// The technique whose probes are baked by default.
pub const BAKES: &str = "probe-volume";
/// The technique that is nothing without a bake.
pub const NEEDS_BAKE: &str = "sparse-probes";

/// The settings of a technique that are fixed when it has been baked.
pub fn baked_settings(technique: &str) -> &'static [&'static str] {
    match technique {
        BAKES => &BAKED,
        NEEDS_BAKE => &lucerna::techniques::sparse_probes::BAKED,
        _ => &[],
    }
}

/// Settings of [`BAKES`] that are fixed when it has baked; the others are chosen when light is looked up.
pub const BAKED: [&str; 7] = ["cells", "paths", "bounces", "noise", "refine", "relocation", "seed"];

/// Flags of `render` itself: all techniques have them.
const SHARED: [&str; 2] = ["bounces", "seed"];

/// A flag: its name, and the techniques that have it, with their setting and its default.
struct Flag {
    name: &'static str,
    of: Vec<(&'static TechniqueEntry, &'static Setting, SettingValue)>,
}

fn flags(of_bakes: bool) -> Vec<Flag> {
    let mut flags: Vec<Flag> = Vec::new();
    for technique in TECHNIQUES {
        for (setting, default) in technique.settings.iter().zip((technique.defaults)()) {
            let is_baked = baked_settings(technique.name).contains(&setting.name);
            if SHARED.contains(&setting.name) || (of_bakes && !is_baked) {
                continue;
            }
            let of = (technique, setting, default);
            match flags.iter_mut().find(|flag| flag.name == setting.name) {
                Some(flag) => flag.of.push(of),
                None => flags.push(Flag { name: setting.name, of: vec![of] }),
            }
        }
    }
    flags
}

impl<const OF_BAKES: bool> SettingArguments<OF_BAKES> {
    /// The settings of one technique, to create it with.
    ///
    /// # Errors
    /// A setting was given that the technique does not have.
    pub fn of(&self, technique: &TechniqueEntry) -> Result<Vec<(&str, &str)>, String> {
        let mut out = Vec::new();
        for (name, value) in &self.given {
            if !technique.settings.iter().any(|setting| setting.name == *name) {
                let others = flags(OF_BAKES).into_iter().find(|flag| flag.name == *name);
                let others: Vec<_> =
                    others.iter().flat_map(|flag| &flag.of).map(|(of, ..)| of.name).collect();
                return Err(format!(
                    "--{name} is a setting of {}, but the technique is {}",
                    others.join(" and "),
                    technique.name
                ));
            }
            out.push((*name, value.as_str()));
        }
        Ok(out)
    }

    /// The first that was given.
    pub fn first(&self) -> Option<&'static str> {
        self.given.first().map(|(name, _)| *name)
    }
}

impl<const OF_BAKES: bool> FromArgMatches for SettingArguments<OF_BAKES> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut out = Self::default();
        out.update_from_arg_matches(matches)?;
        Ok(out)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.given = flags(OF_BAKES)
            .into_iter()
            .filter_map(|flag| {
                let value = matches.get_one::<String>(flag.name)?;
                Some((flag.name, value.clone()))
            })
            .collect();
        Ok(())
    }
}

impl<const OF_BAKES: bool> Args for SettingArguments<OF_BAKES> {
    fn augment_args(mut command: Command) -> Command {
        for flag in flags(OF_BAKES) {
            let (_, setting, default) = flag.of[0];
            let heading: Vec<_> = flag.of.iter().map(|(of, ..)| of.name).collect();
            let settings: Vec<_> = flag.of.iter().map(|(_, setting, _)| *setting).collect();
            let mut arg = Arg::new(flag.name)
                .long(flag.name)
                .value_name(value_name(setting))
                .help_heading(heading.join(" and "))
                .help(help_of(setting, default))
                .allow_hyphen_values(true)
                .value_parser(move |text: &str| {
                    let mut last = None;
                    for setting in &settings {
                        match setting.parse(text) {
                            Ok(_) => return Ok(text.to_owned()),
                            Err(error) => {
                                last = Some(format!("possible values: {}", error.possible))
                            }
                        }
                    }
                    Err(last.unwrap_or_default())
                });
            if setting.kind == SettingKind::Switch {
                arg = arg.num_args(0..=1).default_missing_value("on").require_equals(false);
            }
            command = command.arg(arg);
        }
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

fn value_name(setting: &Setting) -> String {
    match setting.kind {
        SettingKind::Switch => "on|off".into(),
        SettingKind::Choice(_) => "WHICH".into(),
        _ if setting.unit.is_empty() => "X".into(),
        _ => setting.unit.to_uppercase(),
    }
}

fn help_of(setting: &Setting, default: SettingValue) -> StyledStr {
    let mut text = setting.help.to_owned();
    let choices = match setting.kind {
        SettingKind::Choice(choices) | SettingKind::Number { words: choices, .. } => choices,
        _ => &[],
    };
    for choice in choices {
        text.push_str(&format!("\n- {}: {}", choice.name, choice.help));
    }
    if !matches!(setting.kind, SettingKind::Choice(_) | SettingKind::Switch) {
        text.push_str(&format!("\n[possible: {}]", setting.possible()));
    }
    text.push_str(&format!("\n[default: {default}]"));
    text.into()
}
