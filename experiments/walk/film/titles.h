#pragma once

namespace mimesis::walk {

struct FilmTitle {
  const char *name, *title;
};
inline constexpr FilmTitle kWalkArms{"walk-arms", "the biped walks at 0.3 m/s and swings its arms"};
inline constexpr FilmTitle kWalkDrawer{
    "walk-drawer", "the biped walks to a drawer, opens it and takes an object out [sec. 3.8]"};
inline constexpr FilmTitle kWalkPush{"walk-push",
                                     "the biped is pushed aside by 10 N s while it walks"};

}  // namespace mimesis::walk
