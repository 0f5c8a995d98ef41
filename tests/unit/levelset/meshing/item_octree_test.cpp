#include "levelset/meshing/front/item_octree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace {

using Imath::V3d;
using levelset::ItemOctree;

struct Item {
  V3d position;
  double size;
  bool isThere = true;
};

/// Items whose sizes range over seven decades, dense where they are small.
std::vector<Item> someItems(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1), exponent(-7, 0);
  std::vector<Item> items;
  for (std::size_t i = 0; i < count; ++i) {
    const double size = std::pow(10.0, exponent(random));
    items.push_back(
        {V3d(unit(random), unit(random), unit(random)) * (5 * std::sqrt(size)) + V3d(40, 0, 0),
         size});
  }
  return items;
}

TEST(ItemOctree, FindsItemsLikeASearchOfAll) {
  std::mt19937 random(1);
  std::vector<Item> items = someItems(2000, random);
  ItemOctree tree(1);
  for (std::uint32_t i = 0; i < items.size(); ++i) tree.add(i, items[i].position, items[i].size);
  for (std::uint32_t i = 0; i < items.size(); i += 3) {
    tree.remove(i, items[i].position, items[i].size);
    items[i].isThere = false;
  }
  std::size_t visited = 0, wanted = 0;
  for (std::size_t k = 0; k < 500; ++k) {
    const Item& near = items[k];
    const double radius = (k % 3 == 0 ? 100 : 3) * near.size, share = k % 2 == 0 ? 0.5 : 0;
    std::vector<bool> isFound(items.size(), false);
    tree.anyNear(near.position, radius, share, [&](std::uint32_t item) {
      EXPECT_TRUE(items[item].isThere);
      EXPECT_FALSE(isFound[item]) << "visited twice";
      isFound[item] = true;
      ++visited;
      return false;
    });
    for (std::size_t i = 0; i < items.size(); ++i) {
      const double reach = radius + share * items[i].size;
      if (!items[i].isThere || (items[i].position - near.position).length() > reach) continue;
      EXPECT_TRUE(isFound[i]) << "item " << i << " of search " << k;
      ++wanted;
    }
  }
  // Cells of about the size of the items: few others are visited.
  EXPECT_GT(wanted, 1000u);
  EXPECT_LT(visited, 12 * wanted);
}

TEST(ItemOctree, StopsAtTheFirstHit) {
  ItemOctree tree(2);
  for (std::uint32_t i = 0; i < 10; ++i) tree.add(i, V3d(0.1 * i), 0.01);
  int calls = 0;
  EXPECT_TRUE(tree.anyNear(V3d(0), 5, 0, [&](std::uint32_t) { return ++calls == 4; }));
  EXPECT_EQ(calls, 4);
  EXPECT_FALSE(tree.anyNear(V3d(50), 5, 0, [](std::uint32_t) { return true; }));
}

}  // namespace
