#include "apps/regress/bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace regress {

double Bound::limit() const {
  switch (kind) {
    case Kind::Measured:
      return std::min(kMargin * stated, ceiling);
    case Kind::Order:
      return std::max(stated - kOrderMargin, least);
    case Kind::Rounding:
      return stated * static_cast<double>(std::numeric_limits<float>::epsilon());
    case Kind::Required:
      break;
  }
  return stated;
}

bool Bound::isMet(double found) const {
  return sense == Sense::AtMost ? std::abs(found) <= limit() : found >= limit();
}

bool Bound::isStale(double found) const {
  if (kind == Kind::Measured) return limit() > kLoosest * std::abs(found);
  return kind == Kind::Order && found > limit() + kLoosestOrder;
}

Bounds& Bounds::measured(const std::string& variant, const std::string& figure,
                         std::initializer_list<MeasuredAt> figures) {
  last_ = all_.size();
  for (const MeasuredAt& at : figures)
    all_.push_back({.variant = variant,
                    .figure = figure,
                    .stated = at.figure,
                    .resolution = at.resolution,
                    .budget = at.budget});
  return *this;
}

Bounds& Bounds::ceiling(double limit, int resolution) {
  for (std::size_t i = last_; i < all_.size(); ++i)
    if (resolution == 0 || all_[i].resolution == resolution) all_[i].ceiling = limit;
  return *this;
}

Bounds& Bounds::order(const std::string& variant, const std::string& figure,
                      std::initializer_list<MeasuredAt> figures, double least) {
  for (const MeasuredAt& at : figures)
    all_.push_back({.variant = variant,
                    .figure = figure,
                    .kind = Bound::Kind::Order,
                    .stated = at.figure,
                    .resolution = at.resolution,
                    .sense = Sense::AtLeast,
                    .budget = at.budget,
                    .least = least});
  return *this;
}

Bounds& Bounds::rounding(const std::string& variant, const std::string& figure, double multiple,
                         int resolution) {
  all_.push_back({.variant = variant,
                  .figure = figure,
                  .kind = Bound::Kind::Rounding,
                  .stated = multiple,
                  .resolution = resolution});
  return *this;
}

Bounds& Bounds::zero(const std::string& variant, const std::string& figure) {
  return required(variant, figure, 0);
}

Bounds& Bounds::required(const std::string& variant, const std::string& figure, double limit,
                         int resolution, Sense sense) {
  all_.push_back({.variant = variant,
                  .figure = figure,
                  .kind = Bound::Kind::Required,
                  .stated = limit,
                  .resolution = resolution,
                  .sense = sense});
  return *this;
}

bool isAsMeasured(double found, double measured) {
  const Bound bound{.stated = measured};
  return bound.isMet(found) && !bound.isStale(found);
}

bool isRounding(double found, double multiple) {
  return Bound{.kind = Bound::Kind::Rounding, .stated = multiple}.isMet(found);
}

}  // namespace regress
