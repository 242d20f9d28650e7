// SPDX-License-Identifier: MIT OR Apache-2.0
//! The `lucerna` program from outside: exit codes, what goes to which stream, and the files it leaves.

mod arguments;
mod bake;
mod inspect;
mod pictures;
mod sparse;
mod support;
