// One script for both pages, for most of it is three.js: each page says which it is.
import { association } from './assoc.js';
import { report } from './main.js';

({ association, report })[document.body.dataset.page]();
