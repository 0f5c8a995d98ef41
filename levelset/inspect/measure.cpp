#include "levelset/inspect/measure.h"
