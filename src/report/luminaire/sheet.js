'use strict';
const [filter, odd, told] = ['#filter', '#odd', '.tools output'].map(name => document.querySelector(name));
const cards = Array.from(document.querySelectorAll('.card'), card => [card, card.textContent.toLowerCase()]);
const show = () => {
  const words = filter.value.toLowerCase().split(/\s+/);
  let shown = 0;
  for (const [card, text] of cards) {
    card.hidden = !(words.every(word => text.includes(word)) && (!odd.checked || card.classList.contains('odd')));
    shown += !card.hidden;
  }
  told.textContent = `${shown} of ${cards.length} shown`;
};
filter.addEventListener('input', show);
odd.addEventListener('input', show);
document.querySelector('.tools').hidden = false;
show();
