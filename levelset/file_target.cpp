#include "levelset/file_target.h"
