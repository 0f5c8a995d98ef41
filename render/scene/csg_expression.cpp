#include "render/scene/csg_expression.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <limits>
#include <utility>

#include "levelset/error.h"

namespace render {
namespace {

// Largest number of operands on the stack during the evaluation; holds() stores one bit for each.
constexpr std::size_t kMostPending = 64;

}  // namespace

/// Parses an expression by recursive descent and writes its steps in postfix order.
class CsgParser {
 public:
  CsgParser(const std::string& text, const std::vector<std::string>& names, std::vector<int>& steps)
      : text_(text), names_(names), steps_(steps) {}

  void parse() {
    chain(0);
    skipBlanks();
    if (at_ < text_.size()) refuse(fmt::format("'{}' is unexpected", text_[at_]));
  }

 private:
  /// Parses operands that operators of one precedence level join. Level 0 is |, level 1 is &, level
  /// 2 is -.
  void chain(std::size_t level) {
    static constexpr std::pair<char, CsgExpression::Step> kOperators[] = {
        {'|', CsgExpression::Union},
        {'&', CsgExpression::Intersection},
        {'-', CsgExpression::Difference}};
    if (level == std::size(kOperators)) return operand();
    chain(level + 1);
    while (take(kOperators[level].first)) {
      chain(level + 1);
      steps_.push_back(kOperators[level].second);
      --pending_;
    }
  }

  void operand() {
    if (take('(')) {
      if (++depth_ > kMostPending) refuse("parentheses are nested more than 64 deep");
      chain(0);
      --depth_;
      if (!take(')')) refuse("a ')' is missing");
      return;
    }
    skipBlanks();
    const std::size_t first = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_'))
      ++at_;
    const std::string name = text_.substr(first, at_ - first);
    if (name.empty()) refuse("a name is missing");
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) {
      at_ = first;
      refuse(fmt::format("there is no solid '{}'", name));
    }
    if (++pending_ > kMostPending) refuse("the expression is nested more than 64 deep");
    steps_.push_back(static_cast<int>(found - names_.begin()));
  }

  void skipBlanks() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool take(char wanted) {
    skipBlanks();
    if (at_ >= text_.size() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }
  [[noreturn]] void refuse(const std::string& why) const {
    std::string all;
    for (const std::string& name : names_) all += (all.empty() ? "" : ", ") + name;
    throw levelset::UsageError(fmt::format(
        "scene: the expression '{}' has an error at character {}: {}; {}", text_, at_ + 1, why,
        all.empty() ? "add level sets, because expressions cannot use meshes"
                    : "write for example '(a | b) - c'; the names are " + all));
  }

  const std::string& text_;
  const std::vector<std::string>& names_;
  std::vector<int>& steps_;
  std::size_t at_ = 0, depth_ = 0, pending_ = 0;
};

CsgExpression::CsgExpression(const std::string& text, const std::vector<std::string>& names)
    : text_(text) {
  CsgParser(text_, names, steps_).parse();
}

bool CsgExpression::holds(const char* inside) const {
  // One bit for each operand: 1 if it contains the point. The top of the stack is the lowest bit.
  std::uint64_t stack = 0;
  for (const int step : steps_) {
    if (step >= 0) {
      stack = stack << 1 | (inside[step] != 0);
      continue;
    }
    if (step == Nothing) {
      stack <<= 1;
      continue;
    }
    const bool b = stack & 1, a = stack >> 1 & 1;
    const bool both = step == Union ? a || b : step == Intersection ? a && b : a && !b;
    stack = stack >> 2 << 1 | both;
  }
  return stack & 1;
}

double CsgExpression::phi(const double* phi) const {
  std::vector<double> stack;
  for (const int step : steps_) {
    if (step >= 0 || step == Nothing) {
      stack.push_back(step >= 0 ? phi[step] : std::numeric_limits<double>::infinity());
      continue;
    }
    const double b = stack.back();
    stack.pop_back();
    double& a = stack.back();
    a = step == Union ? std::min(a, b) : std::max(a, step == Intersection ? b : -b);
  }
  return stack.empty() ? std::numeric_limits<double>::infinity() : stack.back();
}

CsgExpression CsgExpression::renumbered(const std::vector<int>& numbers) const {
  CsgExpression result = *this;
  for (int& step : result.steps_) {
    if (step < 0) continue;
    step = numbers[static_cast<std::size_t>(step)];
    if (step < 0) step = Nothing;
  }
  return result;
}

Imath::Box3d CsgExpression::bounds(const std::vector<Imath::Box3d>& boxes, double growth) const {
  std::vector<Imath::Box3d> stack;
  for (const int step : steps_) {
    if (step >= 0 || step == Nothing) {
      stack.push_back(step >= 0 ? boxes[static_cast<std::size_t>(step)] : Imath::Box3d());
      continue;
    }
    const Imath::Box3d b = stack.back();
    stack.pop_back();
    Imath::Box3d& a = stack.back();
    if (step == Union) {
      a.extendBy(b);
      if (!a.isEmpty()) a = {a.min - Imath::V3d(growth), a.max + Imath::V3d(growth)};
    }
    if (step != Intersection) continue;
    for (int axis = 0; axis < 3; ++axis) {
      a.min[axis] = std::max(a.min[axis], b.min[axis]);
      a.max[axis] = std::min(a.max[axis], b.max[axis]);
    }
    if (a.isEmpty()) a.makeEmpty();
  }
  return stack.empty() ? Imath::Box3d() : stack.back();
}

bool CsgExpression::uses(std::size_t solid) const {
  return std::find(steps_.begin(), steps_.end(), static_cast<int>(solid)) != steps_.end();
}

}  // namespace render
