#include "levelset/molecules/molecule.h"

#include <fmt/core.h>

#include <algorithm>

namespace levelset {
namespace {

constexpr std::array<std::string_view, 119> kSymbols = {
    "",   "H",  "He", "Li", "Be", "B",  "C",  "N",  "O",  "F",  "Ne", "Na", "Mg", "Al", "Si",
    "P",  "S",  "Cl", "Ar", "K",  "Ca", "Sc", "Ti", "V",  "Cr", "Mn", "Fe", "Co", "Ni", "Cu",
    "Zn", "Ga", "Ge", "As", "Se", "Br", "Kr", "Rb", "Sr", "Y",  "Zr", "Nb", "Mo", "Tc", "Ru",
    "Rh", "Pd", "Ag", "Cd", "In", "Sn", "Sb", "Te", "I",  "Xe", "Cs", "Ba", "La", "Ce", "Pr",
    "Nd", "Pm", "Sm", "Eu", "Gd", "Tb", "Dy", "Ho", "Er", "Tm", "Yb", "Lu", "Hf", "Ta", "W",
    "Re", "Os", "Ir", "Pt", "Au", "Hg", "Tl", "Pb", "Bi", "Po", "At", "Rn", "Fr", "Ra", "Ac",
    "Th", "Pa", "U",  "Np", "Pu", "Am", "Cm", "Bk", "Cf", "Es", "Fm", "Md", "No", "Lr", "Rf",
    "Db", "Sg", "Bh", "Hs", "Mt", "Ds", "Rg", "Cn", "Nh", "Fl", "Mc", "Lv", "Ts", "Og"};

struct ElementRadius {
  int element;
  double radius;
};
// [Bondi64, table I and II] and [Mantina09, table 12].
constexpr ElementRadius kRadii[] = {
    {1, 1.20},  {2, 1.40},  {3, 1.81},  {4, 1.53},  {5, 1.92},  {6, 1.70},  {7, 1.55},  {8, 1.52},
    {9, 1.47},  {10, 1.54}, {11, 2.27}, {12, 1.73}, {13, 1.84}, {14, 2.10}, {15, 1.80}, {16, 1.80},
    {17, 1.75}, {18, 1.88}, {19, 2.75}, {20, 2.31}, {28, 1.63}, {29, 1.40}, {30, 1.39}, {31, 1.87},
    {32, 2.11}, {33, 1.85}, {34, 1.90}, {35, 1.83}, {36, 2.02}, {37, 3.03}, {38, 2.49}, {46, 1.63},
    {47, 1.72}, {48, 1.58}, {49, 1.93}, {50, 2.17}, {51, 2.06}, {52, 2.06}, {53, 1.98}, {54, 2.16},
    {55, 3.43}, {56, 2.68}, {78, 1.75}, {79, 1.66}, {80, 1.55}, {81, 1.96}, {82, 2.02}, {83, 2.07},
    {84, 1.97}, {85, 2.02}, {86, 2.20}, {87, 3.48}, {88, 2.83}, {92, 1.86}};

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c | 0x20) : c;
}

}  // namespace

Imath::Box3d Molecule::bounds() const {
  Imath::Box3d box;
  for (const Atom& atom : atoms) {
    const Imath::V3d radius(vanDerWaalsRadius(atom.element));
    box.extendBy(atom.position - radius);
    box.extendBy(atom.position + radius);
  }
  return box;
}

std::size_t Molecule::bytes() const {
  return sizeof(Atom) * atoms.capacity() + sizeof(Residue) * residues.capacity() +
         sizeof(std::string) * chains.capacity();
}

std::string Molecule::residueName(std::size_t residue) const {
  const Residue& of = residues[residue];
  return fmt::format("{}/{} {}{}", chains[of.chain], of.name, of.number, of.insertion);
}

double vanDerWaalsRadius(int element) {
  const int asked = element == 0 ? 6 : element;
  const auto* found = std::find_if(std::begin(kRadii), std::end(kRadii),
                                   [&](const ElementRadius& r) { return r.element == asked; });
  return found != std::end(kRadii) ? found->radius : 2;
}

int atomicNumber(std::string_view symbol) {
  if (symbol.size() == 1 && lower(symbol[0]) == 'd') return 1;
  for (std::size_t n = 1; n < kSymbols.size(); ++n)
    if (std::equal(symbol.begin(), symbol.end(), kSymbols[n].begin(), kSymbols[n].end(),
                   [](char a, char b) { return lower(a) == lower(b); }))
      return static_cast<int>(n);
  return 0;
}

std::string_view elementSymbol(int element) {
  return kSymbols[static_cast<std::size_t>(std::clamp(element, 0, 118))];
}

}  // namespace levelset
