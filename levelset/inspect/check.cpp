#include "levelset/inspect/check.h"
