#include "levelset/fields/expression.h"

#include <fmt/core.h>
#include <muParser.h>
#include <oneapi/tbb/enumerable_thread_specific.h>

#include <memory>

#include "levelset/error.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Variables that a formula may use: coordinates, time or both, and their names for messages.
struct Variables {
  bool space = false, time = false;
  const char* names = "";
};
constexpr Variables kSpace = {true, false, "x, y, z, r"}, kTime = {false, true, "t"},
                    kSpaceAndTime = {true, true, "x, y, z, r, t"};

/// A muParser object and its variables. The parser binds the variables by address, so each thread
/// needs a copy.
class Formula {
 public:
  Formula(const std::string& text, const Variables& variables)
      : text_(text), variables_(variables) {
    if (variables.space) {
      parser_.DefineVar("x", &place_.x);
      parser_.DefineVar("y", &place_.y);
      parser_.DefineVar("z", &place_.z);
      parser_.DefineVar("r", &radius_);
    }
    if (variables.time) parser_.DefineVar("t", &time_);
    parser_.DefineConst("pi", M_PI);
    parser_.SetExpr(text);
  }
  Formula(const Formula& other) : Formula(other.text_, other.variables_) {}
  Formula& operator=(const Formula&) = delete;

  /// Evaluates the formulas of the text, which commas separate, and returns their values. `count`
  /// receives the number of formulas.
  const double* evaluate(const V3d& place, double time, int& count) {
    place_ = place;
    radius_ = place.length();
    time_ = time;
    return parser_.Eval(count);
  }

 private:
  std::string text_;
  Variables variables_;
  mu::Parser parser_;
  V3d place_ = V3d(0);
  double radius_ = 0, time_ = 0;
};

class Formulas {
 public:
  Formulas(const std::string& text, const Variables& variables, int count)
      : perThread_(read(text, variables)) {
    int found = 0;
    try {
      perThread_.local().evaluate(V3d(0.5), 0.5, found);
    } catch (const mu::Parser::exception_type& error) {
      refuse(text, variables, error.GetMsg());
    }
    if (found != count) {
      throw UsageError(fmt::format("'{}' holds {} formula{}; give {}", text, found,
                                   found == 1 ? "" : "s",
                                   count == 1 ? "one" : "three with commas between them"));
    }
  }
  const double* operator()(const V3d& place, double time) {
    int count = 0;
    return perThread_.local().evaluate(place, time, count);
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
  return [formulas](const V3d& world) { return (*formulas)(world, 0)[0]; };
}

VectorField vectorExpression(const std::string& text) {
  const auto formulas = std::make_shared<Formulas>(text, kSpaceAndTime, 3);
  return [formulas](const V3d& world, double time) {
    const double* values = (*formulas)(world, time);
    return V3d(values[0], values[1], values[2]);
  };
}

std::function<double(double)> timeExpression(const std::string& text) {
  const auto formulas = std::make_shared<Formulas>(text, kTime, 1);
  return [formulas](double time) { return (*formulas)(V3d(0), time)[0]; };
}

}  // namespace levelset
