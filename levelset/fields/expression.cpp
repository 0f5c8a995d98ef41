#include "levelset/fields/expression.h"

#include <fmt/core.h>
#include <muParser.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <initializer_list>
#include <memory>

#include "levelset/error.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Variables that a formula may use: coordinates, time, normal and curvature, and their names for
/// messages.
struct Variables {
  bool space = false, time = false, surface = false;
  const char* names = "";
};
constexpr Variables kSpace = {true, false, false, "x, y, z, r"}, kTime = {false, true, false, "t"},
                    kSpaceAndTime = {true, true, false, "x, y, z, r, t"},
                    kSurface = {true, true, true, "x, y, z, r, t, nx, ny, nz, k"};

/// A muParser object and its variables. The parser binds the variables by address, so each thread
/// needs a copy.
class Formula {
 public:
  Formula(const std::string& text, const Variables& variables)
      : text_(text), variables_(variables) {
    if (variables.space) {
      parser_.DefineVar("x", &point_.position.x);
      parser_.DefineVar("y", &point_.position.y);
      parser_.DefineVar("z", &point_.position.z);
      parser_.DefineVar("r", &radius_);
    }
    if (variables.time) parser_.DefineVar("t", &point_.time);
    if (variables.surface) {
      parser_.DefineVar("nx", &point_.normal.x);
      parser_.DefineVar("ny", &point_.normal.y);
      parser_.DefineVar("nz", &point_.normal.z);
      parser_.DefineVar("k", &point_.curvature);
    }
    parser_.DefineConst("pi", M_PI);
    parser_.SetExpr(text);
  }
  Formula(const Formula& other) : Formula(other.text_, other.variables_) {}
  Formula& operator=(const Formula&) = delete;

  /// Evaluates the formulas of the text, which commas separate, and returns their values. `count`
  /// receives the number of formulas.
  const double* evaluate(const SurfacePoint& point, int& count) {
    point_ = point;
    radius_ = point.position.length();
    return parser_.Eval(count);
  }

  /// Returns true when the text contains one of the variables.
  [[nodiscard]] bool uses(std::initializer_list<const char*> names) const {
    const auto& used = parser_.GetUsedVar();
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return used.count(name) > 0; });
  }

 private:
  std::string text_;
  Variables variables_;
  mu::Parser parser_;
  SurfacePoint point_;
  double radius_ = 0;
};

class Formulas {
 public:
  Formulas(const std::string& text, const Variables& variables, int count)
      : perThread_(read(text, variables)) {
    int found = 0;
    try {
      perThread_.local().evaluate({V3d(0.5), 0.5, V3d(0.5), 0.5}, found);
    } catch (const mu::Parser::exception_type& error) {
      refuse(text, variables, error.GetMsg());
    }
    if (found != count) {
      throw UsageError(fmt::format("'{}' holds {} formula{}; give {}", text, found,
                                   found == 1 ? "" : "s",
                                   count == 1 ? "one" : "three with commas between them"));
    }
  }
  const double* operator()(const SurfacePoint& point) {
    int count = 0;
    return perThread_.local().evaluate(point, count);
  }
  [[nodiscard]] bool uses(std::initializer_list<const char*> names) {
    return perThread_.local().uses(names);
  }

 private:
  /// Parses the text of the formulas. The parser's constructor refuses a text that is too long.
  static Formula read(const std::string& text, const Variables& variables) {
    try {
      return {text, variables};
    } catch (const mu::Parser::exception_type& error) {
      refuse(text, variables, error.GetMsg());
    }
  }
  [[noreturn]] static void refuse(const std::string& text, const Variables& variables,
                                  const std::string& why) {
    constexpr std::size_t kMaxShown = 200;
    throw UsageError(
        fmt::format("the formula '{}' cannot be read: {}; use {}, numbers and functions such "
                    "as sin({})",
                    text.size() > kMaxShown ? text.substr(0, kMaxShown) + "…" : text, why,
                    variables.names, variables.names[0]));
  }

  oneapi::tbb::enumerable_thread_specific<Formula> perThread_;
};

}  // namespace

ScalarField scalarExpression(const std::string& text) {
  const auto formulas = std::make_shared<Formulas>(text, kSpace, 1);
  return [formulas](const V3d& world) { return (*formulas)({world})[0]; };
}

VectorField vectorExpression(const std::string& text) {
  const auto formulas = std::make_shared<Formulas>(text, kSpaceAndTime, 3);
  return [formulas](const V3d& world, double time) {
    const double* values = (*formulas)({world, time});
    return V3d(values[0], values[1], values[2]);
  };
}

std::function<double(double)> timeExpression(const std::string& text) {
  const auto formulas = std::make_shared<Formulas>(text, kTime, 1);
  return [formulas](double time) { return (*formulas)({V3d(0), time})[0]; };
}

NormalSpeed speedExpression(const std::string& text) {
  const auto formulas = std::make_shared<Formulas>(text, kSurface, 1);
  return {.value = [formulas](const SurfacePoint& point) { return (*formulas)(point)[0]; },
          .usesTime = formulas->uses({"t"}),
          .usesNormal = formulas->uses({"nx", "ny", "nz"}),
          .usesCurvature = formulas->uses({"k"})};
}

}  // namespace levelset
