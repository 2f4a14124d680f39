//! Measured fabrics become positive definite ones, and what is dropped is told.

use toile::pattern::export::{fabric_to_json, garment_to_json};
use toile::pattern::import::{fabric_from_json, garment_from_file, garment_from_json};

#[test]
fn measured_fabrics_are_read_from_sample_zero() {
    let Some(data) = crate::common_data::data_dir() else {
        return;
    };
    for (file, expected) in [
        (
            "11oz-black-denim",
            [
                0.324,
                205.352005,
                10.234077,
                1013.88629,
                0.5 * 53.387184,
                64.196457e-6,
                96.951576e-6,
            ],
        ),
        (
            "ivory-rib-knit",
            [
                0.276,
                42.871021,
                -0.234556,
                65.166023,
                0.5 * 83.175644,
                46.237591e-6,
                32.243889e-6,
            ],
        ),
        (
            "pink-ribbon-brown",
            [
                0.228,
                151.503906,
                106.028160,
                244.830673,
                0.5 * 30.250183,
                117.070122e-6,
                59.774277e-6,
            ],
        ),
    ] {
        let path = data.join("materials").join(format!("{file}.json"));
        let (f, notes) = fabric_from_json(&std::fs::read_to_string(path).unwrap()).unwrap();
        let read = [
            f.density,
            f.weft,
            f.coupling,
            f.warp,
            f.shear,
            f.bending_weft,
            f.bending_warp,
        ];
        assert_eq!(read, expected);
        f.check().unwrap();
        println!("{file}: {notes:?}");
        assert!(notes.iter().any(|n| n.contains("dropped the 5 rows")));
        let (again, none) = fabric_from_json(&fabric_to_json(&f).unwrap()).unwrap();
        assert!(again == f && none.is_empty());
    }
}

#[test]
fn real_garments_come_back_from_toiles_own_json_bit_for_bit() {
    let Some(data) = crate::common_data::data_dir() else {
        return;
    };
    for file in [
        "garmentcode/gen_tshirt_specification.json",
        "garmentcode/shirt_mean_specification.json",
        "garmentcode/dress_pencil_specification.json",
        "gpg/skirt_4_panels.json",
        "gpg/tee.json",
    ] {
        let (garment, _) = garment_from_file(&data.join(file)).unwrap();
        let text = garment_to_json(&garment).unwrap();
        assert_eq!(garment_from_json(&text, None).unwrap(), garment, "{file}");
    }
}
