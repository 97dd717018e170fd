//! Keys of the scene file as data: a [`Table`] for each section, of which the parser, its errors and the reference all
//! speak.
//!
//! A parser reads through [`Section`], which takes a [`Key`] and no other name: a key that is in no table can't be
//! asked for, and what a table holds is what a section may say.

use toml::de::DeTable;

use super::super::fields::{Fields, Placed, Source};
use crate::error::{InputError, Location};

/// A key: its name, the form of its value, and what the reference tells of it.
pub(crate) struct Key<F> {
    name: &'static str,
    form: F,
    /// What counts without it, in words.
    default: &'static str,
    /// A value for the message that it is missing; empty where it never is.
    example: &'static str,
    /// One sentence.
    meaning: &'static str,
}

impl<F> Key<F> {
    /// A key that its section must have.
    pub(crate) const fn needed(name: &'static str, form: F, example: &'static str, meaning: &'static str) -> Self {
        Self { name, form, default: "required", example, meaning }
    }

    /// A key that may be left out: `default` counts then.
    pub(crate) const fn optional(name: &'static str, form: F, default: &'static str, meaning: &'static str) -> Self {
        Self { name, form, default, example: "", meaning }
    }

    /// A key that may be left out in some cases; `default` says in which.
    pub(crate) const fn needed_unless(
        name: &'static str,
        form: F,
        default: &'static str,
        example: &'static str,
        meaning: &'static str,
    ) -> Self {
        Self { name, form, default, example, meaning }
    }
}

/// The form of a value, as the reference tells it.
pub(crate) trait Form: Sync {
    /// Its unit; empty where it has none.
    fn unit(&self) -> &'static str {
        ""
    }

    /// Which values there are, in words.
    fn range(&self) -> String;

    /// Tables within the value.
    fn tables(&self) -> Vec<&'static Table> {
        Vec::new()
    }
}

/// A form whose values a section holds under one key.
pub(crate) trait KeyKind: Form {
    /// The value, as the rest of the program takes it.
    type Value;

    /// The value of `key`, if the section has it.
    ///
    /// # Errors
    /// Where the value is of another form.
    fn read(&self, section: &Section<'_>, key: &str) -> Result<Option<Self::Value>, InputError>;
}

/// A key of any form.
pub(crate) trait AnyKey: Sync {
    fn name(&self) -> &'static str;
    fn unit(&self) -> &'static str;
    fn range(&self) -> String;
    fn default(&self) -> &'static str;
    fn example(&self) -> &'static str;
    fn meaning(&self) -> &'static str;
    fn tables(&self) -> Vec<&'static Table>;
}

impl<F: Form> AnyKey for Key<F> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn unit(&self) -> &'static str {
        self.form.unit()
    }

    fn range(&self) -> String {
        self.form.range()
    }

    fn default(&self) -> &'static str {
        self.default
    }

    fn example(&self) -> &'static str {
        self.example
    }

    fn meaning(&self) -> &'static str {
        self.meaning
    }

    fn tables(&self) -> Vec<&'static Table> {
        self.form.tables()
    }
}

/// The keys of a section, and what the reference tells of it beside them.
pub(crate) struct Table {
    /// Its head as the user writes it; the key's name where the section is the value of a key.
    pub(crate) head: &'static str,
    /// What the section is, in a few sentences.
    pub(crate) about: &'static str,
    /// In the order in which messages and the reference name them.
    pub(crate) keys: &'static [&'static dyn AnyKey],
    /// Rules between keys, a sentence each.
    pub(crate) rules: &'static [&'static str],
    /// TOML that parses; empty for the value of a key.
    pub(crate) example: &'static str,
}

impl Table {
    fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|key| key.name()).collect()
    }
}

/// A section that is read.
pub(crate) struct Section<'a> {
    pub(super) fields: Fields<'a>,
    table: &'static Table,
}

impl<'a> Section<'a> {
    /// A section that may have the keys of `table`. `head` is its name in messages, `at` the line of its head.
    ///
    /// # Errors
    /// Where it has other keys.
    pub(crate) fn new(
        source: &'a Source,
        head: impl Into<String>,
        at: Location,
        toml: &'a DeTable<'a>,
        table: &'static Table,
    ) -> Result<Self, InputError> {
        Ok(Self { fields: Fields::new(source, head, at, toml, &table.names())?, table })
    }

    /// The value of a key.
    ///
    /// # Errors
    /// Where the value is of another form.
    pub(crate) fn get<K: KeyKind>(&self, key: &Key<K>) -> Result<Option<K::Value>, InputError> {
        self.asked(key);
        key.form.read(self, key.name)
    }

    /// The value of a key, and its place.
    ///
    /// # Errors
    /// As [`get`](Self::get).
    pub(crate) fn placed<K: KeyKind>(&self, key: &Key<K>) -> Result<Option<Placed<K::Value>>, InputError> {
        let value = self.get(key)?;
        Ok(value.zip(self.fields.place(key.name)).map(|(value, at)| Placed { value, at }))
    }

    /// The value of a key that must be there.
    ///
    /// # Errors
    /// As [`get`](Self::get); also where there is none.
    pub(crate) fn need<K: KeyKind>(&self, key: &Key<K>) -> Result<K::Value, InputError> {
        self.get(key)?.ok_or_else(|| self.missing(key))
    }

    /// The same with its place.
    ///
    /// # Errors
    /// As [`need`](Self::need).
    pub(crate) fn need_placed<K: KeyKind>(&self, key: &Key<K>) -> Result<Placed<K::Value>, InputError> {
        self.placed(key)?.ok_or_else(|| self.missing(key))
    }

    /// Whether it has a key.
    pub(crate) fn has(&self, key: &dyn AnyKey) -> bool {
        self.fields.has(key.name())
    }

    /// A refusal, as it lacks a key.
    pub(crate) fn missing(&self, key: &dyn AnyKey) -> InputError {
        self.fields.missing(key.name(), key.example())
    }

    /// A refusal of what a key says, in the words of the file.
    pub(crate) fn refusal(&self, key: &dyn AnyKey, expected: impl Into<String>) -> InputError {
        self.fields.refusal(key.name(), expected)
    }

    /// Line of its head.
    pub(crate) fn at(&self) -> &Location {
        &self.fields.at
    }

    /// Its name in messages.
    pub(crate) fn head(&self) -> &str {
        self.fields.section()
    }

    /// Number of keys it has.
    pub(crate) fn len(&self) -> usize {
        self.fields.keys().len()
    }

    /// The table that `key` holds; `expected` says what it looks like.
    pub(super) fn inner(
        &self,
        key: &str,
        expected: &str,
        table: &'static Table,
    ) -> Result<Option<Section<'a>>, InputError> {
        let inner = self.fields.table(key, expected, &table.names())?;
        Ok(inner.map(|fields| Section { fields, table }))
    }

    /// The sections `[[key]]`, each checked for strange keys when it is its turn.
    ///
    /// # Errors
    /// Where the key holds something else.
    pub(crate) fn sections(
        &self,
        key: &Key<Sections>,
    ) -> Result<impl Iterator<Item = Result<Section<'a>, InputError>> + use<'a>, InputError> {
        self.asked(key);
        let table = key.form.0;
        let expected = || format!("sections that begin with {}", table.head);
        let all = self.fields.sections(key.name);
        let all = all.map_err(|error| InputError { expected: expected(), ..error })?;
        let source = self.fields.source();
        Ok(all.into_iter().map(move |(at, toml)| Section::new(source, table.head, at, toml, table)))
    }

    /// The sections `[key.NAME]` by name, each checked for strange keys when it is its turn; `head` makes its name in
    /// messages of that.
    ///
    /// # Errors
    /// Where the key holds something else.
    #[allow(clippy::type_complexity, reason = "a name for it would say less")]
    pub(crate) fn named_sections(
        &self,
        key: &Key<NamedSections>,
        head: fn(&str) -> String,
    ) -> Result<impl Iterator<Item = Result<(&'a str, Section<'a>), InputError>> + use<'a>, InputError> {
        self.asked(key);
        let (table, source) = (key.form.0, self.fields.source());
        let all = self.fields.named_sections(key.name)?;
        Ok(all.into_iter().map(move |(name, at, toml)| {
            Section::new(source, head(name), at, toml, table).map(|section| (name, section))
        }))
    }

    /// Notes that a parser asks for a key, which must be one of the section's table.
    pub(super) fn asked(&self, key: &dyn AnyKey) {
        debug_assert!(self.table.names().contains(&key.name()), "{} is no key of {}", key.name(), self.table.head);
        #[cfg(test)]
        asked::note(self.table.head, key.name());
    }
}

/// Sections of one table: `[[head]]`.
pub(crate) struct Sections(pub(crate) &'static Table);

impl Form for Sections {
    fn range(&self) -> String {
        format!("sections `{}`", self.0.head)
    }

    fn tables(&self) -> Vec<&'static Table> {
        vec![self.0]
    }
}

/// Sections of one table, each with a name in its head: `[key.NAME]`.
pub(crate) struct NamedSections(pub(crate) &'static Table);

impl Form for NamedSections {
    fn range(&self) -> String {
        format!("sections `{}`", self.0.head)
    }

    fn tables(&self) -> Vec<&'static Table> {
        vec![self.0]
    }
}

/// Which keys parsers have asked for in this thread.
#[cfg(test)]
pub(super) mod asked {
    use std::cell::RefCell;
    use std::collections::BTreeSet;

    thread_local! {
        static ASKED: RefCell<BTreeSet<(&'static str, &'static str)>> = const { RefCell::new(BTreeSet::new()) };
    }

    pub(super) fn note(head: &'static str, key: &'static str) {
        ASKED.with_borrow_mut(|asked| asked.insert((head, key)));
    }

    /// Heads of tables and names of keys.
    pub(in super::super) fn all() -> BTreeSet<(&'static str, &'static str)> {
        ASKED.take()
    }
}
