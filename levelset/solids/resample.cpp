#include "levelset/solids/resample.h"
