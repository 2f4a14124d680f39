//! Scene files: schema, reading, writing.
