#include <cstdio>

#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"

int main() {
  const levelset::NarrowBand ball = levelset::makeSphere(1, Imath::V3d(0), 0.1);
  const double volume = levelset::measure(ball).volume;
  std::printf("%.4f\n", volume);
  return volume > 4.1 && volume < 4.3 ? 0 : 1;
}
