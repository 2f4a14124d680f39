//! Contact: cloth against bodies.

pub mod body;
