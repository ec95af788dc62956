//! Lines of a table: what separates their entries, and what an entry stands for.

/// What stands for a value that is not there, in any case.
const MISSING: [&str; 6] = ["na", "n/a", "null", "none", "-", "--"];
/// Whether a line is a row by itself: of three numbers or more, or of three or more that are missing. Words may stand among
/// them, but where blanks separate, as they do in any text, only fewer of them than numbers.
pub(super) fn is_row(line: &str) -> bool {
    let line = line.trim_start_matches('\u{feff}');
    let separator = Separator::of(line);
    let entries = separator.entries(line);
    let count = |is: fn(&Entry) -> bool| entries.iter().filter(|entry| is(entry)).count();
    let numbers = count(|entry| matches!(entry, Entry::Number(_)));
    let words = count(|entry| *entry == Entry::Word);
    let are_few = words == 0 || separator != Separator::Blanks || words < numbers;
    let is_missing =
        words == 0 && entries.len() >= 3 && count(|entry| *entry == Entry::Missing) > 0;
    (numbers >= 3 && are_few) || is_missing
}

/// Whether a line tells nothing of a row.
pub(super) fn is_comment(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with('#') || line.starts_with("//") || line.starts_with('%')
}

/// What stands between the numbers of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    Comma,
    Semicolon,
    /// Each of its own, where two stand side by side.
    Tab,
    /// Blanks and tabs, as many as there are.
    Blanks,
}

/// What stands between two separators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry {
    Number(f64),
    /// Nothing, or a word that says so.
    Missing,
    Word,
}

impl Separator {
    /// That of a line. Commas are no separators where they stand within numbers between tabs or blanks.
    pub(super) fn of(line: &str) -> Self {
        let has = |separator| line.split(outside_quotes(|c| c == separator)).nth(1).is_some();
        if has(';') {
            return Self::Semicolon;
        }
        let are_numbers = |separator: Self| {
            let entries = separator.entries(line);
            let numbers = entries.iter().filter(|entry| matches!(entry, Entry::Number(_))).count();
            (numbers >= 3, !entries.contains(&Entry::Word))
        };
        let between_blanks = are_numbers(Self::Blanks) == (true, true);
        let between_tabs = !between_blanks && has('\t') && are_numbers(Self::Tab).0;
        // One tab after each: an entry between two of them may be empty on another line.
        let between_tabs_alone = Self::Tab.words(line).into_iter().filter(|word| !word.is_empty());
        let are_tabs = has('\t') && between_tabs_alone.count() == Self::Blanks.words(line).len();
        match () {
            () if has(',') && !between_blanks && !between_tabs => Self::Comma,
            () if between_tabs || are_tabs || line.trim().contains("\t\t") => Self::Tab,
            () => Self::Blanks,
        }
    }

    /// The words of a line; a separator between quotes is none.
    pub(super) fn words(self, line: &str) -> Vec<&str> {
        let line = line.trim_end_matches(['\r', '\n']);
        match self {
            Self::Comma => line.split(outside_quotes(|c| c == ',')).map(str::trim).collect(),
            Self::Semicolon => line.split(outside_quotes(|c| c == ';')).map(str::trim).collect(),
            // Blanks beside tabs are none of their own columns.
            Self::Tab => {
                line.trim_matches(' ').split(outside_quotes(|c| c == '\t')).map(str::trim).collect()
            }
            Self::Blanks => {
                let words = line.split(outside_quotes(char::is_whitespace));
                words.filter(|word| !word.is_empty()).collect()
            }
        }
    }

    pub(super) fn entries(self, line: &str) -> Vec<Entry> {
        self.words(line).into_iter().map(|word| self.entry(word)).collect()
    }

    /// What a word stands for; a number may lie between quotes.
    pub(super) fn entry(self, word: &str) -> Entry {
        let word = unquoted(word);
        match word.parse::<f64>() {
            Ok(number) if !number.is_nan() => return Entry::Number(number),
            Ok(_) => return Entry::Missing,
            Err(_) => {}
        }
        if word.is_empty() || MISSING.iter().any(|missing| word.eq_ignore_ascii_case(missing)) {
            return Entry::Missing;
        }
        let number = self.with_point(word).and_then(|word| word.parse().ok());
        number.map_or(Entry::Word, Entry::Number)
    }

    /// A number whose fraction follows a comma (`1,5`), with a point; `None` of anything else, and where commas separate.
    fn with_point(self, word: &str) -> Option<String> {
        let (whole, fraction) = word.split_once(',').filter(|_| self != Self::Comma)?;
        let is_one = whole.ends_with(|c: char| c.is_ascii_digit())
            && fraction.starts_with(|c: char| c.is_ascii_digit())
            && !whole.contains('.')
            && !fraction.contains(['.', ',']);
        is_one.then(|| format!("{whole}.{fraction}"))
    }
}

/// A word without the quotes about it.
pub(super) fn unquoted(word: &str) -> &str {
    let within = word.strip_prefix('"').and_then(|word| word.strip_suffix('"'));
    within.map_or(word, str::trim)
}

/// Finds separators, from the start of a line on.
fn outside_quotes(is_separator: impl Fn(char) -> bool) -> impl FnMut(char) -> bool {
    let mut is_quoted = false;
    move |c| {
        is_quoted ^= c == '"';
        is_separator(c) && !is_quoted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_separated_as_the_first_line_says() {
        let numbers = |line: &str| -> Vec<Option<f64>> {
            let entries = Separator::of(line).entries(line);
            let number = |entry: Entry| match entry {
                Entry::Number(number) => Some(number),
                Entry::Missing => Some(-99.0),
                Entry::Word => None,
            };
            entries.into_iter().map(number).collect()
        };
        let all = |of: &[f64]| of.iter().map(|n| Some(*n)).collect::<Vec<_>>();
        for line in
            [" 1  2\t3 ", "1\t 2\t3\r\n", " 1  2 3 \n", "1,2,3", "1 , 2, 3", "\"1\";\"2\";3"]
        {
            assert_eq!(numbers(line), all(&[1.0, 2.0, 3.0]), "{line:?}");
        }
        assert_eq!(numbers("1, -2e3 ,3"), all(&[1.0, -2000.0, 3.0]));
        for line in
            ["1,,3", "1\t\t3", "1,NA,3", "1 n/a 3", "1;NULL;3", "1 - 3", "1,nan,3", "1,None,3"]
        {
            assert_eq!(numbers(line), all(&[1.0, -99.0, 3.0]), "{line:?}");
        }
        // Decimal commas, where commas do not separate.
        for line in ["1,5;2,25;3", "1,5\t2,25\t3", "1,5 2,25 3"] {
            assert_eq!(numbers(line), all(&[1.5, 2.25, 3.0]), "{line:?}");
        }
        assert_eq!(numbers("1,2,3 4"), [Some(1.0), Some(2.0), None]);
        assert_eq!(numbers("1.234,5;2;3")[0], None, "points between thousands");
        let words = |line: &'static str| Separator::of(line).words(line);
        assert_eq!(words("two words\t1\t2\t3"), ["two words", "1", "2", "3"]);
        assert_eq!(words("\"a; b\",1,2,3"), ["\"a; b\"", "1", "2", "3"]);
    }
}
