#include "host/effects/user_term.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/toml_file.hpp"
#include "host/effects/expression.hpp"
#include "host/effects/expression_parse.hpp"

namespace rotorloop::host {
namespace {

constexpr std::size_t kRows = 6, kMaxParameters = 8;
constexpr std::array<const char*, kRows> kRowNames{"force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"};

}  // namespace

struct UserTermProgram {
  std::size_t parameters = 0;
  std::array<std::array<Expression, kRows>, kMaxParameters> rows{};
};

namespace {

template <class S>
void add_load(const void* own, const S* c, LoadState<S>& s) {
  const UserTermProgram& program = *static_cast<const UserTermProgram*>(own);
  Vec3<S> force, torque;
  S* const sums[kRows] = {&force.x, &force.y, &force.z, &torque.x, &torque.y, &torque.z};
  for (std::size_t k = 0; k < program.parameters; ++k) {
    for (std::size_t row = 0; row < kRows; ++row) {
      const Expression& e = program.rows[k][row];
      if (e.length > 0) *sums[row] += c[k] * evaluate(e, s);
    }
  }
  s.force_B_N += force;
  s.torque_B_N_m += torque;
}

template <class S>
TermHooks<S> hooks() {
  TermHooks<S> h;
  h.body = add_load<S>;
  return h;
}

bool is_id(std::string_view s) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  return !s.empty() && s[0] >= 'a' && s[0] <= 'z' && std::all_of(s.begin(), s.end(), allowed);
}

}  // namespace

struct UserTerms::Entry {
  std::string id, title;
  std::vector<std::string> names, units;
  std::vector<TermParameter> parameters;
  UserTermProgram program;
  Term term;
};

UserTerms::UserTerms(UserTerms&&) noexcept = default;
UserTerms& UserTerms::operator=(UserTerms&&) noexcept = default;
UserTerms::~UserTerms() = default;

class UserTermReader {
 public:
  static UserTerms terms(const TomlFile& file, const EffectCatalogue& catalogue) {
    file.format({1});
    UserTerms out;
    for (const TomlTable& t : file.root().tables("term", 1, 32)) {
      auto entry = std::make_unique<UserTerms::Entry>();
      read(t, *entry);
      if (catalogue.find(entry->id))
        t.fail("id", fmt::format("\"{}\" is an effect of the catalogue", entry->id), "", "give your term an id of its own");
      if (out.find(entry->id))
        t.fail("id", fmt::format("the term \"{}\" occurs twice", entry->id), "a copied block", "give every term its own id");
      out.terms_.push_back(std::move(entry));
    }
    file.refuse_unknown_keys();
    return out;
  }

 private:
  static void read(const TomlTable& t, UserTerms::Entry& e) {
    e.id = t.text("id");
    if (!is_id(e.id))
      t.fail("id", fmt::format("\"{}\" is no id", e.id), "", "use small letters, digits and _, a letter first: \"my_effect\"");
    e.title = t.text("name", e.id);
    const std::vector<TomlTable> parameters = t.tables("parameter", 1, kMaxParameters);
    e.program.parameters = parameters.size();
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      read(parameters[k], e, e.program.rows[k]);
      if (std::find(e.names.begin(), e.names.end() - 1, e.names.back()) != e.names.end() - 1)
        parameters[k].fail("name", fmt::format("\"{}\" has the parameter \"{}\" twice", e.id, e.names.back()), "a copied block",
                           "rename it");
    }
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      e.parameters[k].name = e.names[k];
      e.parameters[k].unit = e.units[k];
    }
    e.term = {{e.id, e.parameters}, hooks<double>(), hooks<PlaceDual>(), hooks<ExtraDual>(), &e.program};
  }

  static void read(const TomlTable& t, UserTerms::Entry& e, std::array<Expression, kRows>& rows) {
    e.names.push_back(t.text("name"));
    e.units.push_back(t.text("unit"));
    constexpr double kHuge = 1e9, kTiny = 1e-15;
    const std::string_view unit = e.units.back();
    TermParameter p;
    p.min = t.number("min", {-kHuge, 0.0, unit});  // 0 is absence
    p.max = t.number("max", {0.0, kHuge, unit});
    if (!(p.min < p.max)) t.fail("max", "min and max are both 0: nothing is left to find", "", "give the parameter a range");
    p.scale = t.number("scale", {kTiny, p.max - p.min, unit});
    e.parameters.push_back(p);
    bool any = false;
    for (std::size_t row = 0; row < kRows; ++row) {
      if (!t.has(kRowNames[row])) continue;
      any = true;
      const std::string text = t.text(kRowNames[row]);
      if (const auto fault = parse_expression(text, rows[row]))
        t.fail(kRowNames[row], fmt::format("expression \"{}\", column {}: {}", text, fault->column, fault->what), "", fault->remedy);
      if (!std::isfinite(in_hover(rows[row])))
        t.fail(kRowNames[row], fmt::format("expression \"{}\" is not finite at rest in hover", text), "a division by a speed or a rate",
               "add a small number to the divisor: v_x / sqrt(v_x * v_x + v_y * v_y + 0.01)");
    }
    if (!any)
      t.fail("name", fmt::format("parameter \"{}\" acts on nothing", e.names.back()), "", "give one of force_x … torque_z an expression");
  }

  static double in_hover(const Expression& e) {
    LoadInput<double> in;
    in.world_B = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    in.p_W_m = {0, 0, 1};
    in.battery_V = 15.0;
    const LoadParameters<double> p;
    const LoadGeometry g;
    LoadState<double> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
    s.omega_rad_s.fill(1000.0);
    for (auto& r : s.rotor) {
      r.thrust_N = 1.0;
      r.torque_N_m = 0.01;
    }
    return evaluate(e, s);
  }
};

UserTerms UserTerms::read(const std::filesystem::path& path, const EffectCatalogue& catalogue) {
  return UserTermReader::terms(TomlFile::read(path), catalogue);
}
UserTerms UserTerms::parse(std::string_view text, const std::filesystem::path& name, const EffectCatalogue& catalogue) {
  return UserTermReader::terms(TomlFile::parse(text, name), catalogue);
}

const Term& UserTerms::operator[](std::size_t i) const { return terms_.at(i)->term; }
std::string_view UserTerms::title(std::size_t i) const { return terms_.at(i)->title; }

const Term* UserTerms::find(std::string_view id) const {
  for (const auto& e : terms_) {
    if (e->id == id) return &e->term;
  }
  return nullptr;
}

void UserTerms::join(EffectCatalogue& catalogue) const {
  for (const auto& e : terms_) {
    CatalogueEffect& row = catalogue.effects.emplace_back();
    row.id = e->id;
    row.name = e->title;
    row.kind = EffectKind::term;
    for (const TermParameter& p : e->parameters)
      row.model.push_back({std::string(p.name), std::string(p.unit), p.min, p.max, p.neutral, p.scale});
    row.parameter = row.model.front();
  }
}

}  // namespace rotorloop::host
