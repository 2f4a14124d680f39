//! What hosts and people look at: surfaces, exports, pictures.
