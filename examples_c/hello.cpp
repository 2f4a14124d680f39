// The same hello in C++: a cloth falls on a sphere; its state is saved and taken back.
//
// The laws at the end: no vertex is inside the sphere, and a restored simulation goes on bit by bit
// as the first time.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "toile.hpp"

static void holds(bool law, const char *what) {
    if (!law) {
        std::fprintf(stderr, "does not hold: %s\n", what);
        std::exit(1);
    }
}

int main() try {
    const double corners[] = {-0.2, -0.2, 0.2, -0.2, 0.2, 0.2, -0.2, 0.2};
    toile::garment garment;
    auto panel = toile::panel_desc();
    panel.vertices = corners;
    panel.vertex_count = 4;
    panel.edge_length = 0.05;
    panel.position[1] = 0.16;
    panel.quaternion_xyzw[0] = -std::sqrt(0.5);
    panel.quaternion_xyzw[3] = std::sqrt(0.5);
    garment.add_panel(panel);

    toile::sim sim(garment);
    const auto number = sim.add_body(toile::body::sphere(0.15));
    toile_step_report report{};
    for (int i = 0; i < 15; ++i) report = sim.step(1.0 / 30);
    const auto saved = sim.save();
    for (int i = 0; i < 5; ++i) report = sim.step(1.0 / 30);
    const auto first = sim.save();
    sim.restore(saved);
    for (int i = 0; i < 5; ++i) report = sim.step(1.0 / 30);

    const auto [force, torque] = sim.body_wrench(number);
    std::printf("%.3f s, smallest gap %.3f mm, force on the sphere %.4f N\n", sim.time(),
                1e3 * report.min_gap, force[1]);
    holds(sim.save() == first, "a restored simulation goes on as the first time");
    holds(report.min_gap > -1e-3, "no vertex is inside the sphere");
    holds(force[1] < 0, "the cloth weighs on the sphere");
    holds(std::abs(torque[1]) < 1e-2, "nothing turns the sphere");

    // a patch of jersey, its top held, drawn; then its yarns are taken away and the triangles go on
    auto swatch = toile::garment::from_json(R"({"toile_garment": 1, "edge_length": 0.01,
        "panels": [{"name": "p", "fabric": "y",
            "vertices": [[0, 0], [0.02, 0], [0.02, 0.018], [0, 0.018]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}],
        "fabrics": [{"name": "y", "yarns": {"preset": "jersey"}}]})");
    swatch.set_blend_region(0, {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}});
    toile::sim knit(swatch);
    const auto top = knit.yarn_nodes_along(0, 2);
    knit.pin_yarn_nodes(top);
    knit.step(1e-3);
    const auto curves = knit.yarn_curves(4);
    std::printf("%zu yarns of %zu points, radius %.2f mm, %zu nodes held\n", curves.size(),
                curves.front().size(), 1e3 * knit.yarn_radii().front(), top.size());
    holds(curves.front().size() == 4 * (knit.yarn_indices().size() - 1) + 1, "four to a segment");
    holds(2 * knit.yarn_nodes().size() == 3 * knit.yarn_uv().size(), "nodes are laid and placed");
    holds(knit.yarn_changes().passages_gone == 0, "nothing has come off");
    knit.unpin_yarn_nodes(top);
    knit.set_blend_region(0, {});
    holds(knit.yarn_nodes().empty() && knit.yarn_curves(4).empty(), "triangles again");

    // errors are exceptions with the library's text
    try {
        sim.step(-1);
        holds(false, "a step back in time is refused");
    } catch (const toile::error &e) {
        holds(e.status() == TOILE_E_ARGUMENT, "the status says why");
        std::printf("as expected: %s\n", e.what());
    }
    return 0;
} catch (const toile::error &e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
}
