//! The known word that is nearest to an unknown one, for error messages.

/// Returns the known word that an unknown word most likely stands for, or `None` if no word is similar.
///
/// A typing error is a missing, added or wrong letter, or two swapped neighbours. A known word is similar if there is at
/// most one error for each three letters; case, and `_`, `.` or a space in place of `-`, do not count. If no word is similar, a known word
/// that begins or ends with the unknown one is returned: `friction` stands for `contact.friction`.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain =
        |word: &str| word.trim_start_matches('-').to_lowercase().replace(['_', ' ', '.'], "-");
    let word = plain(word);
    let length = word.chars().count();
    if length < 2 {
        return None;
    }
    let known: Vec<_> = known.into_iter().map(|one| (plain(one), one)).collect();
    let typed = known.iter().map(|(plain, one)| (strsim::osa_distance(&word, plain), *one));
    let typed = typed.min_by_key(|(distance, _)| *distance);
    let is_part = |whole: &str| {
        whole.strip_prefix(&word).is_some_and(|rest| length >= 3 || rest.starts_with('-'))
            || whole.strip_suffix(&word).is_some_and(|rest| rest.ends_with('-'))
    };
    let of_part = || known.iter().find(|(plain, _)| is_part(plain)).map(|(_, one)| *one);
    typed.filter(|(distance, _)| *distance <= length / 3).map(|(_, one)| one).or_else(of_part)
}

/// Returns ` (did you mean 'x'?)` with the [`nearest`] word, or an empty text.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    nearest(word, known).map_or_else(String::new, |known| format!(" (did you mean '{known}'?)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_one_typing_error_in_three_letters_away() {
        let known = ["run", "scenes", "show", "tear_force", "contact.friction", "wind.velocity"];
        for (word, nearest_word) in [
            ("rnu", Some("run")),
            ("Run", Some("run")),
            ("scene", Some("scenes")),
            ("shwo", Some("show")),
            ("tear-force", Some("tear_force")),
            ("taer_frce", Some("tear_force")),
            ("friction", Some("contact.friction")),
            ("wind", Some("wind.velocity")),
            ("gravity", None),
            ("r", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, known), nearest_word, "{word}");
        }
        assert_eq!(did_you_mean("rnu", known), " (did you mean 'run'?)");
        assert_eq!(did_you_mean("gravity", known), "");
    }
}
