//! Refuses garments that cannot be, naming panel, edge or seam.
