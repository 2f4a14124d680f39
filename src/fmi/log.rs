//! What an instance tells its master: which categories there are, and when it speaks.

use std::fmt;

/// Status of a call, with the numbers that FMI 2 and 3 share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, and there is something to tell.
    Warning = 1,
    /// Not done, nothing changed; a shorter step may do.
    Discard = 2,
    /// Not done; only a reset, a saved state or the end may follow.
    Error = 3,
}

/// Every log category with its meaning, as the model description lists them.
pub const CATEGORIES: &[(&str, &str)] = &[
    (
        "logStatusError",
        "calls that were refused, told even when logging is off",
    ),
    ("logStatusDiscard", "steps that could not be taken"),
    (
        "logStatusWarning",
        "results to be looked at, such as an iteration limit that was hit",
    ),
    (
        "logEvents",
        "steps that were cut into substeps, drapes, rebuilt simulations",
    ),
];

/// Name of the category of all messages, which FMI 2 has.
pub const ALL: &str = "logAll";

/// The master's callback: status, category, message.
pub type Sink = Box<dyn Fn(Status, &str, &str) + Send>;

/// The master's log.
pub struct Log {
    sink: Option<Sink>,
    on: bool,
    /// Categories asked for; empty: all of them.
    only: Vec<&'static str>,
}

impl fmt::Debug for Log {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Log {{ on: {}, only: {:?} }}", self.on, self.only)
    }
}

impl Log {
    /// A log that speaks through `sink`, if there is one.
    pub fn new(sink: Option<Sink>, on: bool) -> Self {
        Self {
            sink,
            on,
            only: Vec::new(),
        }
    }

    /// Turns messages that are no errors on or off; no categories mean all of them. An unknown
    /// category is the error.
    pub fn set(&mut self, on: bool, categories: &[String]) -> Result<(), String> {
        let mut only = Vec::new();
        for wanted in categories {
            if wanted == ALL {
                only = CATEGORIES.iter().map(|c| c.0).collect();
                continue;
            }
            match CATEGORIES.iter().find(|c| c.0 == wanted) {
                Some(known) => only.push(known.0),
                None => return Err(wanted.clone()),
            }
        }
        (self.on, self.only) = (on, only);
        Ok(())
    }

    /// Says something: errors always, other messages if they are asked for.
    pub fn say(&self, status: Status, message: impl FnOnce() -> String) {
        let category = match status {
            Status::Error => "logStatusError",
            Status::Discard => "logStatusDiscard",
            Status::Warning => "logStatusWarning",
            Status::Ok => "logEvents",
        };
        let asked = self.on && (self.only.is_empty() || self.only.contains(&category));
        if let Some(sink) = &self.sink
            && (status == Status::Error || asked)
        {
            sink(status, category, &message());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    #[test]
    fn errors_are_told_always_and_the_rest_by_category() {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let own = Arc::clone(&heard);
        let sink: Sink =
            Box::new(move |_, category, _| own.lock().unwrap().push(category.to_owned()));
        let mut log = Log::new(Some(sink), false);
        let all = |log: &Log| {
            for s in [Status::Ok, Status::Warning, Status::Discard, Status::Error] {
                log.say(s, String::new);
            }
            std::mem::take(&mut *heard.lock().unwrap())
        };
        assert_eq!(all(&log), ["logStatusError"]);
        log.set(true, &[]).unwrap();
        assert_eq!(all(&log).len(), 4);
        log.set(true, &["logEvents".into()]).unwrap();
        assert_eq!(all(&log), ["logEvents", "logStatusError"]);
        assert_eq!(log.set(true, &["noise".into()]), Err("noise".into()));
        log.set(true, &[ALL.into()]).unwrap();
        assert_eq!(all(&log).len(), 4);
    }
}
