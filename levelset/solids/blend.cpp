#include "levelset/solids/blend.h"
