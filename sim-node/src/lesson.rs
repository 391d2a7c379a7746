//! `lesson`: tables for teachers of physics, computed when they are asked for.

mod euler;
mod experiment;
mod f32;
mod iterations;
mod stiffness;
mod table;

use anyhow::Context;
use clap::ValueEnum;
use serde::Serialize;

use crate::args::{LessonArgs, LessonName};
use table::Table;

/// Prints a lesson, or lists all of them.
#[allow(clippy::print_stdout, reason = "the result of the command")]
pub(crate) fn lesson(args: &LessonArgs) -> anyhow::Result<()> {
    let text = match (args.lesson, args.json) {
        (None, false) => {
            let lines = list().map(|Listed { name, text }| format!("{name:<10} {text}"));
            lines.collect::<Vec<_>>().join("\n") + "\n"
        }
        (None, true) => json(&list().collect::<Vec<_>>())?,
        (Some(name), false) => printed(&tables(name)?),
        (Some(name), true) => json(&tables(name)?)?,
    };
    print!("{text}");
    Ok(())
}

/// One lesson in the list.
#[derive(Serialize)]
struct Listed {
    name: String,
    text: String,
}

fn list() -> impl Iterator<Item = Listed> {
    let values = LessonName::value_variants().iter().filter_map(ValueEnum::to_possible_value);
    values.map(|value| Listed {
        name: value.get_name().to_owned(),
        text: value.get_help().map(ToString::to_string).unwrap_or_default(),
    })
}

fn tables(name: LessonName) -> anyhow::Result<Vec<Table>> {
    match name {
        LessonName::Euler => euler::tables(),
        LessonName::Iterations => iterations::tables(),
        LessonName::Stiffness => stiffness::tables(),
        LessonName::F32 => f32::tables(),
    }
}

fn printed(tables: &[Table]) -> String {
    tables.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n")
}

fn json(value: &impl Serialize) -> anyhow::Result<String> {
    let text = serde_json::to_string_pretty(value).context("writing the lesson")?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    //! The texts as a whole; the numbers are checked against closed forms beside each lesson.

    use super::*;

    #[test]
    fn each_lesson_prints_its_tables() {
        for name in LessonName::value_variants() {
            insta::assert_snapshot!(
                format!("{name:?}").to_lowercase(),
                printed(&tables(*name).unwrap())
            );
        }
    }

    #[test]
    fn the_list_has_a_line_for_each_lesson() {
        let list: Vec<_> = list().collect();
        assert_eq!(list.len(), 4);
        assert!(list.iter().all(|one| !one.text.is_empty()));
    }

    #[test]
    fn every_lesson_has_rows_in_json() {
        for name in LessonName::value_variants() {
            let json = json(&tables(*name).unwrap()).unwrap();
            let json: serde_json::Value = serde_json::from_str(&json).unwrap();
            for table in json.as_array().unwrap() {
                let columns = table["columns"].as_array().unwrap();
                for row in table["rows"].as_array().unwrap() {
                    assert_eq!(row.as_object().unwrap().len(), columns.len(), "{}", table["name"]);
                }
            }
        }
    }
}
