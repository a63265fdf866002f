// Terms written in a file: the language of their expressions, exact derivatives, and errors that say where and what.
#include "host/effects/user_term.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "host/base/error.hpp"
#include "host/effects/expression.hpp"
#include "host/effects/expression_parse.hpp"
#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

using testing::AllOf;
using testing::HasSubstr;

double value(const std::string& text) {
  Expression e;
  const auto fault = parse_expression(text, e);
  EXPECT_FALSE(fault) << text << ": " << (fault ? fault->what : "");
  const LoadInput<double> in = general_flight();
  const VehicleModel m = paper_vehicle();
  const LoadParameters<double> p = load_parameters(m);
  const LoadGeometry g = load_geometry(m);
  LoadState<double> s{in, p, g, {}, {}, {}, {}, {}, {}, {}};
  loads<double>(s, nullptr);
  return evaluate(e, s);
}

TEST(UserExpression, KnowsTheOrderOfOperations) {
  EXPECT_EQ(value("1 + 2 * 3"), 7.0);
  EXPECT_EQ(value("(1 + 2) * 3"), 9.0);
  EXPECT_EQ(value("10 - 4 - 3"), 3.0);
  EXPECT_EQ(value("12 / 3 / 2"), 2.0);
  EXPECT_EQ(value("-2 * -3"), 6.0);
  EXPECT_EQ(value("2 - -3"), 5.0);
  EXPECT_EQ(value("1.5e-3*2e3"), 3.0);
}

TEST(UserExpression, HasFunctions) {
  EXPECT_EQ(value("sqrt(9) + abs(-4) + min(2, 1) + max(2, 1)"), 10.0);
  EXPECT_EQ(value("sqrt(-1)"), 0.0) << "the root of a negative number is 0";
}

TEST(UserExpression, SeesMotionRotorsPlaceAndBattery) {
  EXPECT_EQ(value("v_x"), 6.0);
  EXPECT_EQ(value("v_z"), 1.5);
  EXPECT_EQ(value("r"), 3.0);
  EXPECT_EQ(value("z"), 2.0);
  EXPECT_EQ(value("up_z"), 1.0);
  EXPECT_EQ(value("omega_3"), 970.0);
  EXPECT_EQ(value("omegadot_4"), 1200.0);
  EXPECT_EQ(value("battery"), 15.0);
  EXPECT_NEAR(value("torque_2"), 3.1e-8 * 905 * 905, 1e-12);
  EXPECT_GT(value("thrust_3"), value("thrust_2"));
}

ExpressionFault fault(const std::string& text) {
  Expression e;
  const auto f = parse_expression(text, e);
  EXPECT_TRUE(f) << text;
  return f.value_or(ExpressionFault{});
}

TEST(UserExpression, SaysAtWhichColumnItIsWrong) {
  EXPECT_EQ(fault("v_x * * 2").column, 7u);
  EXPECT_THAT(fault("v_x ^ 2").remedy, HasSubstr("x * x"));
  EXPECT_EQ(fault("v_x v_y").column, 5u);
  EXPECT_EQ(fault("(v_x").column, 5u);
  EXPECT_EQ(fault("min(v_x)").column, 8u);
  EXPECT_THAT(fault("v_u").what, HasSubstr("\"v_u\" is neither"));
  EXPECT_THAT(fault("v_u").remedy, HasSubstr("v_x, v_y, v_z, p, q, r"));
  EXPECT_EQ(fault("").column, 1u);
  EXPECT_EQ(fault("1e999").column, 1u);
}

TEST(UserExpression, RefusesWhatWouldNotFitIntoTheController) {
  std::string sum = "v_x", nested = "v_x";
  for (int i = 0; i < 40; ++i) {
    sum += " + v_x";
    nested = "(" + nested + ")";
  }
  EXPECT_THAT(fault(sum).what, HasSubstr("too long"));
  EXPECT_THAT(fault(nested).what, HasSubstr("nested"));
  std::string right = "v_x";
  for (int i = 0; i < 15; ++i) right = "v_x + (" + right + ")";
  EXPECT_THAT(fault(right).what, HasSubstr("too deeply"));
}

// The moment that turns the nose up in flight, once more but written by a user, and a spring.
constexpr const char* kFile = R"toml(format = 1

[[term]]
id = "nose_up"
name = "Nose-up moment"

[[term.parameter]]
name = "k_N_s2"
unit = "N s2"
min = -2e-5
max = 2e-5
scale = 1e-6
torque_x = "(omega_1 + omega_2 + omega_3 + omega_4) * v_y"
torque_y = "-(omega_1 + omega_2 + omega_3 + omega_4) * v_x"

[[term]]
id = "low_pressure"

[[term.parameter]]
name = "k_N_m"
unit = "N/m"
min = 0
max = 2
scale = 0.5
force_z = "max(0, 0.5 - z) * thrust_1 / max(0.1, abs(v_x))"

[[term.parameter]]
name = "d"
unit = "N s/m"
min = 0
max = 1
scale = 0.1
force_x = "-v_x * sqrt(v_x * v_x + v_y * v_y)"
)toml";

std::string with(const std::string& what, const std::string& by) {
  std::string text = kFile;
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}
std::string refusal(const std::string& text) {
  try {
    (void)UserTerms::parse(text, "my_terms.toml", builtin_effect_catalogue());
  } catch (const Error& e) {
    return e.what();
  }
  return "accepted";
}

TEST(UserTerms, LoadTheBodyLikeATermInCode) {
  const UserTerms terms = UserTerms::parse(kFile, "my_terms.toml", builtin_effect_catalogue());
  ASSERT_EQ(terms.size(), 2u);
  EXPECT_EQ(terms.title(0), "Nose-up moment");
  const Wrench mine = wrench(general_flight(), only(*terms.find("nose_up")), {2.3e-6});
  const Wrench built_in = wrench(general_flight(), only("hub_moment"), {2.3e-6, 2.3e-6});
  EXPECT_LT((mine.torque - built_in.torque).norm(), 1e-15);
  EXPECT_LT((mine.force - built_in.force).norm(), 1e-15);
}

TEST(UserTerms, ChangeNothingAtZeroAndHaveExactDerivatives) {
  const UserTerms terms = UserTerms::parse(kFile, "my_terms.toml", builtin_effect_catalogue());
  const TermList list = only(*terms.find("low_pressure"));
  LoadInput<double> in = general_flight();
  in.p_W_m = {0.1, 0.2, 0.3};
  EXPECT_LT((wrench(in, list, {0, 0}).force - wrench(in).force).norm(), 1e-15);

  using D = PlaceDual;
  LoadInput<D> seeded;
  const VehicleModel m = paper_vehicle();
  const LoadParameters<double> p = load_parameters(m);
  const LoadParameters<D> q{p.k1_N_s2, p.k2_N_s2_m, p.c_q_N_m_s2, p.com_x_m, p.com_y_m, p.c_dh_s_m, p.c_dxy_N_s2_m2, p.c_dz_N_s2_m2};
  seeded.v_B_m_s = {D::variable(in.v_B_m_s.x, 0), D::variable(in.v_B_m_s.y, 1), D::variable(in.v_B_m_s.z, 2)};
  seeded.p_W_m = {in.p_W_m.x, in.p_W_m.y, D::variable(in.p_W_m.z, 3)};
  for (std::size_t i = 0; i < kRotors; ++i) seeded.omega_rad_s[i] = D(in.omega_rad_s[i]);
  const LoadGeometry g = load_geometry(m);
  LoadState<D> s{seeded, q, g, {}, {}, {}, {}, {}, {}, {}};
  const D c[] = {D(0.7), D(0.2)};
  const TermSet<D> set(list, c);
  loads(s, &set);
  double* const moved[] = {&in.v_B_m_s.x, &in.v_B_m_s.y, &in.v_B_m_s.z, &in.p_W_m.z};
  for (std::size_t j = 0; j < 4; ++j) {
    const double at = *moved[j], e = 1e-5;
    *moved[j] = at + e;
    const Eigen::Vector3d up = wrench(in, list, {0.7, 0.2}).force;
    *moved[j] = at - e;
    const Eigen::Vector3d slope = (up - wrench(in, list, {0.7, 0.2}).force) / (2 * e);
    *moved[j] = at;
    EXPECT_NEAR(s.force_B_N.x.d[j], slope.x(), 1e-7) << j;
    EXPECT_NEAR(s.force_B_N.z.d[j], slope.z(), 1e-7) << j;
  }
}

TEST(UserTerms, MakeVehicleFilesThatHoldThemReadable) {
  const UserTerms terms = UserTerms::parse(kFile, "my_terms.toml", builtin_effect_catalogue());
  EffectCatalogue catalogue = builtin_effect_catalogue();
  terms.join(catalogue);
  ASSERT_TRUE(catalogue.find("low_pressure"));
  const std::vector<CatalogueParameter>& model = catalogue.find("low_pressure")->model;
  ASSERT_EQ(model.size(), 2u);
  EXPECT_EQ(model[1].name, "d");
  EXPECT_EQ(model[1].max, 1.0);
}

TEST(UserTerms, TheExampleOfTheManualIsOne) {
  std::ifstream page(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "docs/own_terms.md");
  const std::string text((std::istreambuf_iterator<char>(page)), {});
  const std::size_t begin = text.find("```toml\n") + 8, end = text.find("```", begin);
  ASSERT_NE(end, std::string::npos);
  const UserTerms terms = UserTerms::parse(text.substr(begin, end - begin), "docs/own_terms.md", builtin_effect_catalogue());
  LoadInput<double> in = general_flight();
  in.v_B_m_s = {10.0, 0.0, 0.0};
  const Wrench with = wrench(in, only(terms[0]), {1e-3}), without = wrench(in);
  EXPECT_NEAR((with.force - without.force).x(), -0.1, 1e-12) << "N, against the motion";
  EXPECT_NEAR((with.torque - without.torque).y(), -0.006, 1e-12) << "N m, nose-up";
}

TEST(UserTerms, ErrorsNameFileLineExpressionAndColumn) {
  EXPECT_THAT(refusal(with("-v_x * sqrt", "-v_u * sqrt")),
              AllOf(HasSubstr("my_terms.toml:33"), HasSubstr("column 2"), HasSubstr("\"v_u\""), HasSubstr("variables: v_x")));
  EXPECT_THAT(refusal(with("max(0.1, abs(v_x))", "v_x")), AllOf(HasSubstr("my_terms.toml:25"), HasSubstr("not finite at rest")));
  EXPECT_THAT(refusal(with("\"nose_up\"", "\"wind_steady\"")), HasSubstr("\"wind_steady\" is an effect of the catalogue"));
  EXPECT_THAT(refusal(with("\"nose_up\"", "\"Nose up\"")), HasSubstr("no id"));
  EXPECT_THAT(refusal(with("\"low_pressure\"", "\"nose_up\"")), HasSubstr("twice"));
  EXPECT_THAT(refusal(with("name = \"d\"", "name = \"k_N_m\"")), HasSubstr("twice"));
  EXPECT_THAT(refusal(with("min = -2e-5", "min = 2e-5")), HasSubstr("min"));
  EXPECT_THAT(refusal(with("force_x = ", "push_x = ")), HasSubstr("acts on nothing"));
  EXPECT_THAT(refusal(with("scale = 0.1", "scale = 0.1\nsize = 2")), HasSubstr("size"));
}

}  // namespace
}  // namespace rotorloop::host
