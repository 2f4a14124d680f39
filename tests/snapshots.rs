//! Snapshots belong to a garment, to bodies and to tunables, and are refused elsewhere.

use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::Fabric;
use toile::sim::{ContactSettings, Settings, Sim, SimOptions};
use toile::tri::grid::sheet_garment;

fn sim(body: &Body, contact: &ContactSettings, settings: Settings) -> Sim {
    let garment = sheet_garment(0.2, 0.2, 0.05, Fabric::default());
    let options = SimOptions {
        settings,
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).unwrap();
    sim.add_body(body, contact).unwrap();
    sim
}

fn tetrahedron(size: f64) -> Body {
    let x = [
        [0.0; 3],
        [size, 0.0, 0.0],
        [0.0, size, 0.0],
        [0.0, 0.0, size],
    ];
    let t = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    Body::mesh(&x, &t, 0.05 * size).unwrap()
}

fn grid(radius: f64) -> Body {
    let n = 5;
    let mut values = Vec::new();
    for i in 0..n * n * n {
        let at = [i / (n * n), i / n % n, i % n].map(|c| c as f64 * 0.1 - 0.2);
        values.push(Vec3::from(at).norm() - radius);
    }
    Body::grid([n; 3], [-0.2; 3], 0.1, &values).unwrap()
}

#[test]
fn a_snapshot_is_refused_where_a_body_has_another_shape() {
    let contact = ContactSettings::default();
    let shapes = [
        Body::sphere(0.1).unwrap(),
        Body::sphere(0.11).unwrap(),
        Body::capsule(0.0, 0.1).unwrap(),
        Body::capsule(0.1, 0.1).unwrap(),
        Body::plane([0.0, 1.0, 0.0], 0.0).unwrap(),
        Body::plane([0.0, 1.0, 0.0], -0.1).unwrap(),
        tetrahedron(0.2),
        tetrahedron(0.3),
        grid(0.1),
        grid(0.11),
    ];
    for (a, first) in shapes.iter().enumerate() {
        let bytes = sim(first, &contact, Settings::default()).save().unwrap();
        for (b, second) in shapes.iter().enumerate() {
            let mut other = sim(second, &contact, Settings::default());
            let before = other.save().unwrap();
            match other.restore(&bytes) {
                Ok(()) => assert_eq!(a, b),
                Err(e) => {
                    assert_ne!(a, b, "{e}");
                    assert!(e.to_string().contains("shape of body 0"), "{e}");
                    assert_eq!(other.save().unwrap(), before);
                }
            }
        }
    }
}

#[test]
fn a_snapshot_is_refused_where_contact_or_tunables_differ_and_the_text_says_which() {
    let ball = Body::sphere(0.1).unwrap();
    let contact = ContactSettings::default();
    let bytes = sim(&ball, &contact, Settings::default()).save().unwrap();
    let others = [
        (
            ContactSettings {
                friction: 0.5,
                ..contact
            },
            "friction 0.3 of body 0, here it is 0.5",
        ),
        (
            ContactSettings {
                thickness: 0.004,
                ..contact
            },
            "thickness 0.003",
        ),
        (
            ContactSettings {
                stiffness: 1e6,
                ..contact
            },
            "stiffness 10000000",
        ),
    ];
    for (other, text) in others {
        let error = sim(&ball, &other, Settings::default())
            .restore(&bytes)
            .unwrap_err();
        assert!(error.to_string().contains(text), "{error}");
    }
    let mut none = sim(&ball, &contact, Settings::default());
    none.add_body(&ball, &contact).unwrap();
    let error = none.restore(&bytes).unwrap_err();
    assert!(
        error.to_string().contains("1 bodies, here are 2"),
        "{error}"
    );
    for key in Settings::KEYS {
        let mut other = sim(&ball, &contact, Settings::default());
        let value = if key.default == key.min {
            key.max.min(2.0)
        } else {
            key.min
        };
        other.set_number(key.name, value).unwrap();
        let restored = other.restore(&bytes);
        if ["solver.threads", "limits.vertices"].contains(&key.name) {
            // on these no bit depends
            restored.unwrap();
        } else {
            let error = restored.unwrap_err().to_string();
            let wanted = format!("{} = {}, here it is {value}", key.name, key.default);
            assert!(error.contains(&wanted), "{error}");
            other.set_number(key.name, key.default).unwrap();
            other.restore(&bytes).unwrap();
        }
    }
}
