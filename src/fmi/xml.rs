//! Elements and attributes, written by quick-xml with everything escaped.

use crate::error::{Error, Result};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// An attribute.
pub(super) type Attribute<'a> = (&'a str, String);

/// A document under construction.
pub(super) struct Xml(Writer<Vec<u8>>);

fn failed(e: &dyn std::fmt::Display) -> Error {
    Error::io(format!("writing XML: {e}"))
}

/// An attribute from anything that can be shown.
pub(super) fn attribute<'a>(name: &'a str, value: impl ToString) -> Attribute<'a> {
    (name, value.to_string())
}

/// Characters that XML cannot hold become spaces.
fn clean(text: &str) -> String {
    let fine = |c: char| c >= ' ' && c != '\u{fffe}' && c != '\u{ffff}';
    text.chars()
        .map(|c| if fine(c) { c } else { ' ' })
        .collect()
}

fn start<'a>(name: &'a str, attributes: &[Attribute<'_>]) -> BytesStart<'a> {
    let mut element = BytesStart::new(name);
    for (name, value) in attributes {
        element.push_attribute((*name, clean(value).as_str()));
    }
    element
}

impl Xml {
    /// A document with its declaration.
    pub(super) fn new() -> Result<Self> {
        let mut xml = Self::fragment();
        xml.event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        Ok(xml)
    }

    /// A document without declaration.
    pub(super) fn fragment() -> Self {
        Self(Writer::new_with_indent(Vec::new(), b' ', 1))
    }

    fn event(&mut self, event: Event<'_>) -> Result<()> {
        self.0.write_event(event).map_err(|e| failed(&e))
    }

    /// An element without content.
    pub(super) fn empty(&mut self, name: &str, attributes: &[Attribute<'_>]) -> Result<()> {
        self.event(Event::Empty(start(name, attributes)))
    }

    /// An element with a text.
    pub(super) fn text(
        &mut self,
        name: &str,
        attributes: &[Attribute<'_>],
        text: &str,
    ) -> Result<()> {
        self.event(Event::Start(start(name, attributes)))?;
        self.event(Event::Text(BytesText::new(&clean(text))))?;
        self.event(Event::End(BytesEnd::new(name)))
    }

    /// An element around what `inside` writes.
    pub(super) fn element(
        &mut self,
        name: &str,
        attributes: &[Attribute<'_>],
        inside: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        self.event(Event::Start(start(name, attributes)))?;
        inside(self)?;
        self.event(Event::End(BytesEnd::new(name)))
    }

    /// The bytes, with a line end.
    pub(super) fn finish(self) -> Vec<u8> {
        let mut bytes = self.0.into_inner();
        bytes.push(b'\n');
        bytes
    }
}
