#include "levelset/sample.h"
