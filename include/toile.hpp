// toile.hpp - C++ on top of toile.h: handles that free themselves, errors as exceptions, arrays as
// std::vector. Nothing else; every function of toile.h may be called beside it. C++17.
#ifndef TOILE_HPP
#define TOILE_HPP

#include <array>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "toile.h"

namespace toile {

using vec2 = std::array<double, 2>;
using vec3 = std::array<double, 3>;

/// What a call answered when it was not TOILE_OK.
class error : public std::runtime_error {
public:
    explicit error(toile_status status)
        : std::runtime_error(std::string(toile_status_name(status)) + ": " + toile_last_error()),
          status_(status) {}
    toile_status status() const noexcept { return status_; }

private:
    toile_status status_;
};

inline void check(toile_status status) {
    if (status != TOILE_OK) throw error(status);
}

namespace detail {

template <class T, void (*Free)(T *)>
struct deleter {
    void operator()(T *handle) const noexcept { Free(handle); }
};

template <class T, void (*Free)(T *)>
using handle = std::unique_ptr<T, deleter<T, Free>>;

/// The two calls of an array: how many, then the numbers.
template <class T, class Call>
std::vector<T> array(Call call) {
    std::size_t needed = 0;
    check(call(nullptr, std::size_t{0}, &needed));
    std::vector<T> out(needed);
    if (needed != 0) check(call(out.data(), out.size(), &needed));
    return out;
}

template <class Call>
std::string text(Call call) {
    std::vector<char> out = array<char>(call);
    return std::string(out.data());
}

/// Flat points as plain numbers, row-major.
inline const double *flat(const std::vector<vec2> &points) {
    return points.empty() ? nullptr : points.front().data();
}

/// A struct with its defaults.
template <class T, class Init>
T filled(Init init) {
    T value;
    check(init(&value, sizeof value));
    return value;
}

}  // namespace detail

inline toile_garment_desc garment_desc() {
    return detail::filled<toile_garment_desc>(toile_garment_desc_init);
}
inline toile_panel_desc panel_desc() {
    return detail::filled<toile_panel_desc>(toile_panel_desc_init);
}
inline toile_seam_desc seam_desc() {
    return detail::filled<toile_seam_desc>(toile_seam_desc_init);
}
inline toile_sdf_grid_desc sdf_grid_desc() {
    return detail::filled<toile_sdf_grid_desc>(toile_sdf_grid_desc_init);
}
inline toile_sim_desc sim_desc() { return detail::filled<toile_sim_desc>(toile_sim_desc_init); }
inline toile_contact_desc contact_desc() {
    return detail::filled<toile_contact_desc>(toile_contact_desc_init);
}
inline toile_drape_desc drape_desc() {
    return detail::filled<toile_drape_desc>(toile_drape_desc_init);
}
inline toile_step_report step_report() {
    return detail::filled<toile_step_report>(toile_step_report_init);
}
inline toile_suggest_desc suggest_desc() {
    return detail::filled<toile_suggest_desc>(toile_suggest_desc_init);
}

/// Flat panels, seams, fabrics.
class garment {
public:
    explicit garment(const toile_garment_desc &desc = garment_desc()) {
        toile_garment *made = nullptr;
        check(toile_garment_create(&desc, &made));
        handle_.reset(made);
    }
    static garment from_json(std::string_view json, const char *base_dir = nullptr) {
        toile_garment *made = nullptr;
        check(toile_garment_from_json(json.data(), json.size(), base_dir, &made));
        return garment(made);
    }
    std::uint32_t add_panel(const toile_panel_desc &desc) {
        std::uint32_t index = TOILE_NONE;
        check(toile_garment_add_panel(handle_.get(), &desc, &index));
        return index;
    }
    std::uint32_t add_seam(const toile_seam_desc &desc) {
        std::uint32_t index = TOILE_NONE;
        check(toile_garment_add_seam(handle_.get(), &desc, &index));
        return index;
    }
    void set_fabric(std::string_view json) {
        check(toile_garment_set_fabric(handle_.get(), json.data(), json.size()));
    }
    /// Every yarn inside a polygon of a panel, flat coordinates.
    void set_blend_region(std::uint32_t panel, const std::vector<vec2> &polygon,
                          std::uint32_t rings = 0) {
        check(toile_garment_set_blend_region(handle_.get(), panel, detail::flat(polygon),
                                             polygon.size(), rings));
    }
    void set_blend_vertices(const std::vector<double> &alpha, std::uint32_t rings = 0) {
        check(toile_garment_set_blend_vertices(handle_.get(), alpha.data(), alpha.size(), rings));
    }
    void clear_blend_region() { check(toile_garment_clear_blend_region(handle_.get())); }
    std::uint32_t panel_count() const {
        std::uint32_t count = 0;
        check(toile_garment_panel_count(handle_.get(), &count));
        return count;
    }
    std::string to_json() const {
        return detail::text([this](char *out, std::size_t capacity, std::size_t *needed) {
            return toile_garment_to_json(handle_.get(), out, capacity, needed);
        });
    }
    std::string to_svg(double seam_allowance = 0) const {
        return detail::text([&](char *out, std::size_t capacity, std::size_t *needed) {
            return toile_garment_to_svg(handle_.get(), seam_allowance, out, capacity, needed);
        });
    }
    toile_garment *get() const noexcept { return handle_.get(); }

private:
    friend class sim;
    explicit garment(toile_garment *made) : handle_(made) {}
    detail::handle<toile_garment, toile_garment_free> handle_;
};

/// A signed distance field, negative inside.
class body {
public:
    static body sphere(double radius) {
        return make([&](toile_body **out) { return toile_body_sphere(radius, out); });
    }
    static body capsule(double half_length, double radius) {
        return make([&](toile_body **out) { return toile_body_capsule(half_length, radius, out); });
    }
    static body plane(const vec3 &normal, double offset) {
        return make(
            [&](toile_body **out) { return toile_body_plane(normal.data(), offset, out); });
    }
    static body grid(const toile_sdf_grid_desc &desc) {
        return make([&](toile_body **out) { return toile_body_grid(&desc, out); });
    }
    static body mesh(const std::vector<double> &positions,
                     const std::vector<std::uint32_t> &triangles, double cell_size = 0) {
        return make([&](toile_body **out) {
            return toile_body_mesh(positions.data(), positions.size() / 3, triangles.data(),
                                   triangles.size() / 3, cell_size, out);
        });
    }
    static body obj(const std::string &path, double scale = 1, double cell_size = 0) {
        return make([&](toile_body **out) {
            return toile_body_obj(path.c_str(), scale, cell_size, out);
        });
    }
    double distance(const vec3 &point) const {
        double value = 0;
        check(toile_body_distance(handle_.get(), point.data(), &value, nullptr));
        return value;
    }
    toile_body *get() const noexcept { return handle_.get(); }

private:
    template <class Call>
    static body make(Call call) {
        toile_body *made = nullptr;
        check(call(&made));
        body result;
        result.handle_.reset(made);
        return result;
    }
    body() = default;
    detail::handle<toile_body, toile_body_free> handle_;
};

/// Numbers that stay where and as they are while this lives.
class array {
public:
    explicit array(toile_array *handle) : handle_(handle) {}
    toile_view_f64 view() const {
        auto view = detail::filled<toile_view_f64>(toile_view_f64_init);
        check(toile_array_view(handle_.get(), &view));
        return view;
    }
    toile_array *get() const noexcept { return handle_.get(); }

private:
    detail::handle<toile_array, toile_array_free> handle_;
};

/// A garment in a world.
class sim {
public:
    /// Told how far a drape has come; false stops it.
    using progress = std::function<bool(const toile_progress &)>;

    explicit sim(const garment &cloth, const toile_sim_desc &desc = sim_desc()) {
        toile_sim *made = nullptr;
        check(toile_sim_create(cloth.get(), &desc, &made));
        handle_.reset(made);
    }
    static sim from_scene(std::string_view json, const char *base_dir = nullptr) {
        toile_sim *made = nullptr;
        check(toile_sim_from_scene(json.data(), json.size(), base_dir, &made));
        return sim(made);
    }
    std::uint32_t add_body(const body &shape, const toile_contact_desc &contact = contact_desc()) {
        std::uint32_t number = TOILE_NONE;
        check(toile_sim_set_body_sdf(handle_.get(), shape.get(), &contact, &number));
        return number;
    }
    void set_body_pose(std::uint32_t number, const vec3 &position,
                       const std::array<double, 4> &quaternion_xyzw = {0, 0, 0, 1}) {
        check(toile_sim_set_body_pose(handle_.get(), number, position.data(),
                                      quaternion_xyzw.data()));
    }
    void set_body_vertices(std::uint32_t number, const std::vector<double> &positions) {
        check(toile_sim_set_body_vertices(handle_.get(), number, positions.data(),
                                          positions.size() / 3));
    }
    /// Force and torque of the cloth on a body.
    std::pair<vec3, vec3> body_wrench(std::uint32_t number) const {
        std::pair<vec3, vec3> wrench{};
        check(toile_sim_body_wrench(handle_.get(), number, wrench.first.data(),
                                    wrench.second.data()));
        return wrench;
    }
    void pin(const std::vector<std::uint32_t> &vertices) {
        check(toile_sim_pin(handle_.get(), vertices.data(), vertices.size(), nullptr));
    }
    void pin(const std::vector<std::uint32_t> &vertices, const std::vector<vec3> &targets) {
        if (vertices.size() != targets.size()) {
            throw std::invalid_argument("toile::sim::pin: as many targets as vertices");
        }
        check(toile_sim_pin(handle_.get(), vertices.data(), vertices.size(),
                            targets.empty() ? nullptr : targets.front().data()));
    }
    void unpin(const std::vector<std::uint32_t> &vertices) {
        check(toile_sim_unpin(handle_.get(), vertices.data(), vertices.size()));
    }
    std::uint32_t locate(std::uint32_t panel, double u, double v) const {
        const double uv[2] = {u, v};
        std::uint32_t vertex = TOILE_NONE;
        check(toile_sim_locate(handle_.get(), panel, uv, &vertex));
        return vertex;
    }
    toile_step_report step(double dt) {
        toile_step_report report = step_report();
        check(toile_sim_step(handle_.get(), dt, &report));
        return report;
    }
    /// Exceptions of `told` stop the drape and come out of here.
    toile_step_report drape(toile_drape_desc desc = drape_desc(), const progress &told = nullptr) {
        struct carried {
            const progress *told;
            std::exception_ptr thrown;
        } user{&told, nullptr};
        if (told) {
            desc.progress_user = &user;
            desc.progress = [](void *data, const toile_progress *now) -> std::int32_t {
                auto *to = static_cast<carried *>(data);
                try {
                    return (*to->told)(*now) ? 0 : 1;
                } catch (...) {
                    to->thrown = std::current_exception();
                    return 1;
                }
            };
        }
        toile_step_report report = step_report();
        const toile_status status = toile_sim_drape(handle_.get(), &desc, &report);
        if (user.thrown) std::rethrow_exception(user.thrown);
        check(status);
        return report;
    }
    void set_number(const std::string &name, double value) {
        check(toile_sim_set_number(handle_.get(), name.c_str(), value));
    }
    double number(const std::string &name) const {
        double value = 0;
        check(toile_sim_number(handle_.get(), name.c_str(), &value));
        return value;
    }
    double time() const noexcept { return toile_sim_time(handle_.get()); }
    std::uint64_t epoch() const noexcept { return toile_sim_epoch(handle_.get()); }
    std::vector<double> positions() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_positions(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> velocities() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_velocities(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> normals() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_normals(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint32_t> triangles() const {
        return detail::array<std::uint32_t>(
            [this](std::uint32_t *out, std::size_t n, std::size_t *needed) {
                return toile_sim_triangles(handle_.get(), out, n, needed);
            });
    }
    /// Positions as they are now, in the library's own memory, for as long as the array is kept.
    array positions_array() const {
        toile_array *made = nullptr;
        check(toile_sim_positions_array(handle_.get(), &made));
        return array(made);
    }
    array velocities_array() const {
        toile_array *made = nullptr;
        check(toile_sim_velocities_array(handle_.get(), &made));
        return array(made);
    }
    /// Valid until the next call that is not const.
    toile_view_f64 positions_view() const {
        auto view = detail::filled<toile_view_f64>(toile_view_f64_init);
        check(toile_sim_positions_view(handle_.get(), &view));
        return view;
    }
    toile_energies energies() const {
        auto out = detail::filled<toile_energies>(toile_energies_init);
        check(toile_sim_energies(handle_.get(), &out));
        return out;
    }
    /// Nodes of yarns, positions as in toile_sim_yarn_nodes.
    std::vector<double> yarn_nodes() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_nodes(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_uv() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_uv(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint32_t> yarn_offsets() const {
        return detail::array<std::uint32_t>([this](std::uint32_t *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_offsets(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint32_t> yarn_indices() const {
        return detail::array<std::uint32_t>([this](std::uint32_t *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_indices(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_coordinates() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_coordinates(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_tensions() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_tensions(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_compressions() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_compressions(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_slips() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_slips(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_forces() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_forces(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint8_t> yarn_active() const {
        return detail::array<std::uint8_t>([this](std::uint8_t *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_active(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> yarn_radii() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_radii(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint32_t> yarn_fabrics() const {
        return detail::array<std::uint32_t>([this](std::uint32_t *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_fabrics(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint32_t> yarn_panels() const {
        return detail::array<std::uint32_t>([this](std::uint32_t *out, std::size_t n, std::size_t *needed) {
            return toile_sim_yarn_panels(handle_.get(), out, n, needed);
        });
    }
    std::vector<std::uint8_t> vertex_active() const {
        return detail::array<std::uint8_t>([this](std::uint8_t *out, std::size_t n, std::size_t *needed) {
            return toile_sim_vertex_active(handle_.get(), out, n, needed);
        });
    }
    std::vector<double> vertex_errors() const {
        return detail::array<double>([this](double *out, std::size_t n, std::size_t *needed) {
            return toile_sim_vertex_errors(handle_.get(), out, n, needed);
        });
    }
    /// Points of each yarn as it is drawn, with `samples` pieces between two nodes.
    std::vector<std::vector<vec3>> yarn_curves(std::uint32_t samples) const {
        const auto starts = detail::array<std::uint32_t>(
            [&](std::uint32_t *out, std::size_t n, std::size_t *needed) {
                return toile_sim_yarn_curve_offsets(handle_.get(), samples, out, n, needed);
            });
        const auto points =
            detail::array<double>([&](double *out, std::size_t n, std::size_t *needed) {
                return toile_sim_yarn_curves(handle_.get(), samples, out, n, needed);
            });
        std::vector<std::vector<vec3>> curves;
        for (std::size_t y = 0; y + 1 < starts.size(); ++y) {
            std::vector<vec3> curve;
            for (std::size_t k = starts[y]; k < starts[y + 1]; ++k) {
                curve.push_back({points[3 * k], points[3 * k + 1], points[3 * k + 2]});
            }
            curves.push_back(std::move(curve));
        }
        return curves;
    }
    std::vector<std::uint32_t> yarn_nodes_along(std::uint32_t panel, std::uint32_t edge) const {
        return detail::array<std::uint32_t>(
            [&](std::uint32_t *out, std::size_t n, std::size_t *needed) {
                return toile_sim_yarn_nodes_along(handle_.get(), panel, edge, out, n, needed);
            });
    }
    std::uint32_t locate_yarn_node(std::uint32_t panel, double u, double v) const {
        const double uv[2] = {u, v};
        std::uint32_t node = TOILE_NONE;
        check(toile_sim_locate_yarn_node(handle_.get(), panel, uv, &node));
        return node;
    }
    std::uint32_t yarn_end(std::uint32_t yarn, std::uint32_t end) const {
        std::uint32_t node = TOILE_NONE;
        check(toile_sim_yarn_end(handle_.get(), yarn, end, &node));
        return node;
    }
    void pin_yarn_nodes(const std::vector<std::uint32_t> &nodes) {
        check(toile_sim_pin_yarn_nodes(handle_.get(), nodes.data(), nodes.size(), nullptr));
    }
    void pin_yarn_nodes(const std::vector<std::uint32_t> &nodes, const std::vector<vec3> &targets) {
        if (nodes.size() != targets.size()) {
            throw std::invalid_argument("toile::sim::pin_yarn_nodes: as many targets as nodes");
        }
        check(toile_sim_pin_yarn_nodes(handle_.get(), nodes.data(), nodes.size(),
                                       targets.empty() ? nullptr : targets.front().data()));
    }
    void unpin_yarn_nodes(const std::vector<std::uint32_t> &nodes) {
        check(toile_sim_unpin_yarn_nodes(handle_.get(), nodes.data(), nodes.size()));
    }
    toile_yarn_changes yarn_changes() const {
        auto out = detail::filled<toile_yarn_changes>(toile_yarn_changes_init);
        check(toile_sim_yarn_changes(handle_.get(), &out));
        return out;
    }
    /// Moves the region of a panel in which every yarn is simulated; an empty polygon takes it away.
    void set_blend_region(std::uint32_t panel, const std::vector<vec2> &polygon,
                          std::uint32_t rings = 0) {
        check(toile_sim_set_blend_region(handle_.get(), panel, detail::flat(polygon),
                                         polygon.size(), rings));
    }
    void set_blend_vertices(const std::vector<double> &alpha, std::uint32_t rings = 0) {
        check(toile_sim_set_blend_vertices(handle_.get(), alpha.data(), alpha.size(), rings));
    }
    /// The region in which yarns would change the answer, and what it leaves and costs.
    std::pair<std::vector<double>, toile_suggestion> suggest_region(
        const toile_suggest_desc &desc) const {
        auto found = detail::filled<toile_suggestion>(toile_suggestion_init);
        std::uint32_t count = 0;
        check(toile_sim_vertex_count(handle_.get(), &count));
        std::vector<double> alpha(count);
        check(toile_sim_suggest_region(handle_.get(), &desc, alpha.data(), alpha.size(), nullptr,
                                       &found));
        return {std::move(alpha), found};
    }
    std::vector<std::uint8_t> save() const {
        return detail::array<std::uint8_t>(
            [this](std::uint8_t *out, std::size_t n, std::size_t *needed) {
                return toile_sim_save(handle_.get(), out, n, needed);
            });
    }
    void restore(const std::vector<std::uint8_t> &bytes) {
        check(toile_sim_restore(handle_.get(), bytes.data(), bytes.size()));
    }
    toile_sim *get() const noexcept { return handle_.get(); }

private:
    explicit sim(toile_sim *made) : handle_(made) {}
    detail::handle<toile_sim, toile_sim_free> handle_;
};

}  // namespace toile

#endif
