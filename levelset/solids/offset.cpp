#include "levelset/solids/offset.h"
