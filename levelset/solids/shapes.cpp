#include "levelset/solids/shapes.h"
